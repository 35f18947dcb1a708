// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <charconv>
#include <cstring>
#include <string>
#include <type_traits>

namespace cgs {

/// Appends the little-endian bytes of a number.
template <typename T>
void append_bytes(std::string& out, T value) {
  static_assert(std::is_trivially_copyable_v<T> && std::endian::native == std::endian::little);
  const size_t offset = out.size();
  out.resize(offset + sizeof(T));
  std::memcpy(out.data() + offset, &value, sizeof(T));
}

/// Appends the shortest decimal text that reads back as the same number, in no locale.
template <typename T>
void append_number(std::string& out, T value) {
  char text[32];  // NOLINT(modernize-avoid-c-arrays): shortest double needs at most 24
  const auto [end, error] = std::to_chars(text, text + sizeof(text), value);
  (void)error;
  out.append(text, end);
}

}  // namespace cgs
