// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/images/image.h"

namespace cgs {

// Photographs of phones: HEIC (HEVC) and AVIF (AV1). The container's library and its video decoders
// run in a child process, as neither is proof against hostile bytes.

/// Whether bytes begin as a file of that family does.
bool is_heif(std::string_view bytes);

/// The size of the primary image, upright as the container says it is to be shown.
/// \param bytes  of a whole file, or its beginning if that holds all but pixels
/// \throws BadInput Syntax; LimitError
/// Source: ISO/IEC 23008-12 (HEIF).
ImageSize heif_size(std::string_view bytes, const std::filesystem::path& path);

/// Decodes the primary image, upright, row by row. Colours stay coded as they are, as those of a
/// JPEG with a profile do. Video decoders repair what is damaged within pixels: that is not
/// noticed.
/// \param size  as heif_size() gives it
/// \return 8 bits each of red, green and blue per pixel, and of alpha where the image has it
/// \throws BadInput Syntax, also for an image of another size; LimitError
std::string decode_heif(std::string_view bytes,
                        const ImageSize& size,
                        const std::filesystem::path& path);

/// The Exif part of the primary image as libexif takes it; empty where there is none, or none that
/// can be read, or more than 1 MiB. Its orientation is not to be applied: the container has one of
/// its own.
/// \throws BadInput Syntax; LimitError
std::string heif_exif(std::string_view bytes, const std::filesystem::path& path);

/// What such a file says of its colours.
struct HeifProfile {
  std::string icc;             ///< A profile of at most 4 MiB; empty if it holds none.
  bool is_display_p3 = false;  ///< It states these primaries by number, and no curve of HDR.
};
/// \throws BadInput if the file cannot be read; see run_isolated()
HeifProfile heif_profile(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
