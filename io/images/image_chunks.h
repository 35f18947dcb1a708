// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// Calls visit(name, body) for the chunks of a PNG file up to IEND, until it says false. Checksums
/// are not looked at: see check_image_is_whole().
/// \throws BadInput Truncated
template <typename Visit>
void visit_png_chunks(std::string_view bytes, const std::filesystem::path& path, Visit visit) {
  ByteReader file(bytes, path);
  file.take(8, "PNG magic");
  while (true) {
    uint32_t length = 0;
    for (const char c : file.take(4, "PNG chunk length")) {
      length = length << 8 | static_cast<uint8_t>(c);
    }
    const std::string_view name = file.take(4, "PNG chunk");
    const std::string_view body = file.take(size_t{length}, "PNG chunk");
    file.take(4, "PNG checksum");
    if (name == "IEND" || !visit(name, body)) return;
  }
}

/// The same for the chunks of a WebP file; bodies may have one byte more, to an even number.
/// \throws BadInput Truncated
template <typename Visit>
void visit_webp_chunks(std::string_view bytes, const std::filesystem::path& path, Visit visit) {
  ByteReader file(bytes, path);
  file.take(12, "WebP header");
  while (file.offset() < bytes.size()) {
    const std::string_view name = file.take(4, "WebP chunk");
    const auto length = file.get<uint32_t>("WebP chunk length");
    const std::string_view body = file.take(size_t{length} + length % 2, "WebP chunk");
    if (!visit(name, body)) return;
  }
}

/// Calls visit(marker, body) for the segments of a JPEG file up to the first scan, until it says
/// false. Stray bytes before a marker are passed over, as decoders do.
/// \throws BadInput Truncated, Syntax (a segment shorter than its own length)
template <typename Visit>
void visit_jpeg_segments(ByteReader& file, Visit visit) {
  constexpr int kStartOfScan = 0xDA;
  constexpr int kEnd = 0xD9;
  file.take(2, "JPEG start marker");
  while (true) {
    int marker = 0;  // also what stands for a byte 0xFF of data
    while (marker == 0) {
      while (file.get<uint8_t>("JPEG marker") != 0xFF) {
      }
      marker = 0xFF;
      while (marker == 0xFF) marker = file.get<uint8_t>("JPEG marker");  // fill bytes
    }
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) continue;  // have no length
    if (marker == kStartOfScan || marker == kEnd) return;
    const auto high = file.get<uint8_t>("JPEG segment length");
    const size_t length = size_t{high} << 8 | file.get<uint8_t>("JPEG segment length");
    if (length < 2) file.fail(Defect::Syntax, "JPEG segment shorter than its own length field");
    if (!visit(marker, file.take(length - 2, "JPEG segment"))) return;
  }
}

}  // namespace cgs
