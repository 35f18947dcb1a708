// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

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

}  // namespace cgs::test
