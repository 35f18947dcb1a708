// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace cgs {

inline constexpr uint64_t kHashStart = 0xcbf29ce484222325U;

/// 64-bit FNV-1a of bytes, continuing from `state`: tells content apart, but does not protect
/// against tampering.
/// Source: Fowler, Noll, Vo; draft-eastlake-fnv.
inline uint64_t content_hash(std::string_view bytes, uint64_t state = kHashStart) {
  for (const char c : bytes) state = (state ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return state;
}

/// The same of a file's content, as 16 hexadecimal digits.
/// \throws BadInput as read_in_parts()
std::string file_hash(const std::filesystem::path& file);

}  // namespace cgs
