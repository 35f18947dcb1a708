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

}  // namespace cgs
