// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/checkpoint.h"

#include <array>
#include <system_error>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::string_view kMagic = "CGSCKPT1";

std::filesystem::path current_path(const std::filesystem::path& folder, const std::string& name) {
  return folder / (name + ".checkpoint");
}

std::filesystem::path previous_path(const std::filesystem::path& folder, const std::string& name) {
  return folder / (name + ".previous.checkpoint");
}

// The state in a file if it is whole; \throws BadInput.
std::optional<std::string> read_one(const std::filesystem::path& path, uint64_t belongs_to) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path);
  if (in.take(kMagic.size(), "magic") != kMagic) {
    throw BadInput(Defect::Magic, path, "not a checkpoint of this version of the program");
  }
  const auto key = in.get<uint64_t>("key");
  const auto size = in.get<uint64_t>("size");
  in.expect_records(size, 1, "state");
  const std::string_view state = in.take(size, "state");
  const uint64_t expected = content_hash(std::string_view(bytes).substr(0, in.offset()));
  if (in.get<uint64_t>("hash") != expected || in.remaining() != 0) {
    throw BadInput(Defect::Value, path, "its content does not match its hash");
  }
  if (key != belongs_to) return std::nullopt;
  return std::string(state);
}

bool is_whole(const std::filesystem::path& path, uint64_t belongs_to) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return false;
  try {
    return read_one(path, belongs_to).has_value();
  } catch (const BadInput&) {
    return false;
  }
}

}  // namespace

void write_checkpoint(const std::filesystem::path& folder,
                      const std::string& name,
                      uint64_t belongs_to,
                      std::string_view state) {
  std::string head(kMagic);
  append_bytes(head, belongs_to);
  append_bytes(head, static_cast<uint64_t>(state.size()));
  std::string tail;
  append_bytes(tail, content_hash(state, content_hash(head)));
  const std::filesystem::path path = current_path(folder, name);
  AtomicFile file(path);
  file.write(head);
  file.write(state);
  file.write(tail);
  // A damaged one must not take the place of a whole one.
  if (is_whole(path, belongs_to)) {
    std::error_code error;
    std::filesystem::rename(path, previous_path(folder, name), error);
    if (error) throw IoError(path, "cannot keep the older checkpoint: " + error.message());
  }
  file.commit();
}

SavedState read_checkpoint(const std::filesystem::path& folder,
                           const std::string& name,
                           uint64_t belongs_to) {
  SavedState out;
  for (const auto& path : {current_path(folder, name), previous_path(folder, name)}) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) continue;
    try {
      out.state = read_one(path, belongs_to);
      out.is_of_other = !out.state;
    } catch (const BadInput& damage) {
      if (out.warning.empty()) out.warning = damage.what();
    }
    if (out.state) break;
  }
  if (out.warning.empty()) return out;
  out.warning += out.state ? "; going on from the state before it" : "; starting anew";
  return out;
}

bool has_checkpoint(const std::filesystem::path& folder, const std::string& name) {
  return is_present(current_path(folder, name)) || is_present(previous_path(folder, name));
}

void remove_checkpoint(const std::filesystem::path& folder, const std::string& name) {
  for (const auto& path : {current_path(folder, name), previous_path(folder, name)}) {
    std::error_code error;
    std::filesystem::remove(path, error);
    if (error) throw IoError(path, "cannot remove: " + error.message());
  }
}

}  // namespace cgs
