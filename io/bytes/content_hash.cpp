// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/content_hash.h"

#include <array>
#include <cstdio>

#include "io/bytes/byte_reader.h"

namespace cgs {

std::string file_hash(const std::filesystem::path& file) {
  uint64_t hash = kHashStart;
  read_in_parts(file, [&](std::string_view part) { hash = content_hash(part, hash); });
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

}  // namespace cgs
