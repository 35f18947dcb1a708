// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/bytes/byte_reader.h"

namespace cgs {

enum class ImageFormat { Png, Jpeg, Tiff, WebP, Heif };

/// What the first structures of an image file say about it.
struct ImageHeader {
  ImageFormat format = ImageFormat::Png;
  int width = 0;   ///< [pixels]
  int height = 0;  ///< [pixels]
  /// How the picture lies in its file, as Exif counts (1 = upright), by the tag of TIFF; others
  /// state it in their Exif part.
  int orientation = 1;
  int inks = 0;  ///< Of a JPEG in CMYK or YCCK: 4.
};

/// Recognises the format by its magic bytes and reads the size, without decoding. That of HEIC and
/// AVIF is the size upright.
///
/// \throws BadInput Magic (no image), Unsupported (other image formats; JPEG without loss, with
///         other than 8 bits, or with its height behind its data), Truncated, Syntax, Value (a side
///         of 0); LimitError above max_pixels.
/// Source: PNG (W3C, 2nd ed.) 5; JPEG (ITU-T T.81) Annex B; TIFF 6.0 section 2 and BigTIFF; WebP
///         container specification, VP8 (RFC 6386) 9.1 and VP8L.
ImageHeader parse_image_header(std::string_view bytes,
                               const std::filesystem::path& path,
                               const ReadLimits& limits = {});

/// The same TIFF with an orientation tag that says upright: decoders that heed the tag then give
/// the pixels as they are stored.
/// Source: TIFF 6.0 section 8, Orientation.
std::string upright_tiff(std::string_view bytes, const std::filesystem::path& path);

/// Checks that every byte the file's own structure promises is there, since decoders accept some
/// cut files: PNG chunks with their checksums up to IEND, TIFF strips and tiles, the RIFF length
/// of WebP. (JPEG has no lengths; its decoder tells.)
/// \throws BadInput Truncated, Syntax; LimitError for an ancillary PNG chunk above 8 MiB.
void check_image_is_whole(std::string_view bytes,
                          const ImageHeader& header,
                          const std::filesystem::path& path);

}  // namespace cgs
