// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/gltf_files.h"

#include <optional>
#include <utility>

#include "io/bytes/byte_reader.h"
#include "io/bytes/percent_encoding.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/remedy.h"

namespace cgs {

namespace {

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;  // the second is that of names and URLs
  if (c == '/' || c == '_') return 63;
  return -1;
}

/// Nothing for what is no base64; blanks and missing padding are tolerated.
std::optional<std::string> base64_decoded(std::string_view text) {
  std::string out;
  out.reserve(text.size() / 4 * 3);
  uint32_t bits = 0;
  int count = 0;
  bool is_over = false;
  for (const char c : text) {
    if (c == '\n' || c == '\r' || c == ' ' || c == '\t') continue;
    if (c == '=') {
      is_over = true;
      continue;
    }
    const int digit = base64_digit(c);
    if (digit < 0 || is_over) return std::nullopt;
    bits = bits << 6 | static_cast<uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out += static_cast<char>(bits >> count & 255U);
  }
  return out;
}

/// The content of a data: URI, the part behind "data:".
std::string data_of(std::string_view rest, const JsonValue& object) {
  const size_t comma = rest.find(',');
  const auto fail = [&] {
    object.at("uri").fail(Defect::Syntax, "is a data: URI that does not decode");
  };
  if (comma == std::string_view::npos) fail();
  const std::string text = percent_decoded(rest.substr(comma + 1));
  if (!rest.substr(0, comma).ends_with(";base64")) return text;
  std::optional<std::string> out = base64_decoded(text);
  if (!out) fail();
  return std::move(*out);
}

}  // namespace

std::filesystem::path resolve_beside(const std::filesystem::path& file,
                                     const std::string& name,
                                     const JsonValue& stated) {
  try {
    return resolve_in_scene({file.parent_path()}, name, file);
  } catch (const BadInput& error) {
    if (remedy_of(error) == Remedy::None) throw;
    stated.fail(Defect::Path, "leads out of the folder of the file");
  }
}

std::string_view GltfFiles::kept(const std::string& key, std::string bytes) {
  size_ += bytes.size();
  return known_[key] = std::move(bytes);
}

std::string_view GltfFiles::bytes(const JsonValue& object) {
  constexpr std::string_view kData = "data:";
  const std::string uri = object.at("uri").text();
  if (uri.starts_with(kData)) {
    const std::string key = std::string(kData) + object.pointer();
    const auto known = known_.find(key);
    if (known != known_.end()) return known->second;
    return kept(key, data_of(std::string_view(uri).substr(kData.size()), object));
  }
  const std::string name = percent_decoded(uri);
  std::filesystem::path path = resolve_beside(gltf_, name, object.at("uri"));
  if (!is_present(path)) path = resolve_beside(gltf_, with_slashes(name), object.at("uri"));
  const std::string key = std::filesystem::weakly_canonical(path).string();
  const auto known = known_.find(key);
  return known != known_.end() ? std::string_view(known->second) : kept(key, read_file(path));
}

}  // namespace cgs
