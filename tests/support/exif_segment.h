// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cgs::test {

/// A little-endian Exif segment that states nothing but the orientation, to stand after the first
/// two bytes of a JPEG.
inline std::string orientation_segment(int orientation) {
  const std::string tiff = std::string("II\x2a\0\x08\0\0\0", 8) + std::string("\x01\0", 2) +
                           std::string("\x12\x01\x03\0\x01\0\0\0", 8) +
                           std::string(1, static_cast<char>(orientation)) +
                           std::string("\0\0\0\0\0\0\0", 7);
  const std::string body = std::string("Exif\0\0", 6) + tiff;
  const auto size = static_cast<char>(body.size() + 2);
  return std::string("\xff\xe1\0", 3) + size + body;
}

/// An entry of a TIFF directory with one value, or a rational of value / 10.
struct ExifEntry {
  uint16_t tag;
  uint16_t type;  // 3 = short, 4 = long, 5 = rational
  uint32_t value;
};

/// A whole number as TIFF stores it.
inline std::string exif_number(uint32_t value, int bytes, bool is_big) {
  std::string out;
  for (int i = 0; i < bytes; ++i) {
    out += static_cast<char>(value >> (8 * (is_big ? bytes - 1 - i : i)));
  }
  return out;
}

/// A TIFF file of nothing but the given entries in its Exif directory.
/// \param pixels  bytes that stand before the directories
inline std::string exif_tiff(const std::vector<ExifEntry>& entries,
                             bool is_big,
                             uint32_t pixels = 0) {
  const auto n16 = [&](uint32_t v) { return exif_number(v, 2, is_big); };
  const auto n32 = [&](uint32_t v) { return exif_number(v, 4, is_big); };
  const uint32_t start = 8 + pixels;
  std::string tiff = (is_big ? "MM" : "II") + n16(42) + n32(start) + std::string(pixels, '\7');
  tiff += n16(1) + n16(0x8769) + n16(4) + n32(1) + n32(start + 18) + n32(0);  // where Exif is
  const auto count = static_cast<uint32_t>(entries.size());
  const uint32_t values = start + 18 + 2 + 12 * count + 4;
  std::string data;
  tiff += n16(count);
  for (const ExifEntry& entry : entries) {
    tiff += n16(entry.tag) + n16(entry.type) + n32(1);
    if (entry.type == 5) {
      tiff += n32(values + static_cast<uint32_t>(data.size()));
      data += n32(entry.value) + n32(10);
    } else {
      tiff += entry.type == 3 ? n16(entry.value) + n16(0) : n32(entry.value);
    }
  }
  return tiff + n32(0) + data;
}

}  // namespace cgs::test
