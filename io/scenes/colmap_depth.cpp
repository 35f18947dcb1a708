// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap_depth.h"

#include <array>
#include <cstring>
#include <string>
#include <string_view>

namespace cgs {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 2> kEndings = {".geometric.bin", ".photometric.bin"};

// One of the numbers before the values, and the '&' after it.
uint64_t next_size(ByteReader& file, std::string_view what) {
  constexpr size_t kMostDigits = 10;
  std::string digits;
  for (char c = 0; digits.size() <= kMostDigits; digits += c) {
    c = file.take(1, what)[0];
    if (c == '&') break;
  }
  uint64_t out = 0;
  if (!parse_number(digits, out) || out == 0) {
    file.fail(Defect::Syntax,
              "expected " + std::string(what) + " and '&', as in \"640&480&1&\", found \"" +
                  one_line(digits) + "\"");
  }
  return out;
}

}  // namespace

bool is_colmap_depth_name(const fs::path& path) {
  const std::string name = path.filename().string();
  for (const std::string_view ending : kEndings) {
    if (name.size() > ending.size() && name.ends_with(ending)) return true;
  }
  return false;
}

fs::path colmap_depth_of(const SceneRoot& folder, const fs::path& photograph) {
  for (const std::string_view ending : kEndings) {
    for (auto first = photograph.begin(); first != photograph.end(); ++first) {
      if (*first == "/" || *first == ".." || *first == ".") continue;
      fs::path name;
      for (auto part = first; part != photograph.end(); ++part) name /= *part;
      name += ending;
      if (!is_present(folder.folder / name)) continue;
      return resolve_in_scene(folder, name.string(), folder.folder);
    }
  }
  return {};
}

Raster<float> read_colmap_depth(const fs::path& path, const ReadLimits& limits) {
  const std::string bytes = read_file(path, limits);
  refuse_foreign_content(path, bytes, "a depth map of COLMAP");
  ByteReader file(bytes, path);
  const uint64_t width = next_size(file, "the width");
  const uint64_t height = next_size(file, "the height");
  const uint64_t channels = next_size(file, "the number of values per pixel");
  if (channels != 1) {
    file.fail(Defect::Schema,
              "has " + std::to_string(channels) + " values per pixel, depth has one" +
                  (channels == 3 ? "; is it a normal map?" : ""));
  }
  const uint64_t present = file.remaining() / sizeof(float);
  const bool is_possible = width <= present && height <= present;  // the product cannot overflow
  const uint64_t count = is_possible ? width * height : 0;
  if (!is_possible || count * sizeof(float) != file.remaining()) {
    file.fail(Defect::Count,
              "declares " + std::to_string(width) + " x " + std::to_string(height) + " values, " +
                  std::to_string(file.remaining()) + " bytes follow");
  }
  if (count > limits.max_pixels) {
    throw LimitError(printable(path) + ": " + std::to_string(count) + " pixels, allowed are " +
                     std::to_string(limits.max_pixels));
  }
  Raster<float> out(static_cast<int>(width), static_cast<int>(height), 0);
  std::memcpy(
      out.data.data(), file.take(count * sizeof(float), "depth").data(), count * sizeof(float));
  return out;
}

}  // namespace cgs
