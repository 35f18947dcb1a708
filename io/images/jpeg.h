// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/images/image_header.h"

namespace cgs {

/// The pixels of a JPEG as they are coded, row by row from the top.
struct JpegPixels {
  std::string samples;  ///< width * height * channels bytes
  int channels = 3;     ///< 3: RGB; 4: cyan, magenta, yellow, black, where 255 is no ink
};

/// Decodes a JPEG of grey, RGB, YCbCr, CMYK or YCCK. What libjpeg warns of is damage where it
/// concerns coded data; oddities of headers (a sequential scan with parameters of a progressive
/// one, other versions of JFIF, unknown colour transforms, stray bytes between segments) are not.
///
/// \param header  of these bytes
/// \throws BadInput Truncated for damaged data, Syntax for what cannot be decoded
/// Source: ITU-T T.81; Adobe technical note 5116 (the marker APP14, inverted inks).
JpegPixels decode_jpeg(std::string_view bytes,
                       const ImageHeader& header,
                       const std::filesystem::path& path);

}  // namespace cgs
