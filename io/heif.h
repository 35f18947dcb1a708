// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/image.h"

namespace cgs {

// Photographs of phones: HEIC (HEVC) and AVIF (AV1). Every function decodes in a child process, as
// neither the container's library nor its video decoders are proof against hostile bytes.

/// Whether bytes begin as a file of that family does.
bool is_heif(std::string_view bytes);

/// The size of the primary image, upright as the container says it is to be shown.
/// \param bytes  of a whole file, or its beginning if that holds all but pixels
/// \throws BadInput Syntax; LimitError
/// Source: ISO/IEC 23008-12 (HEIF).
ImageSize heif_size(std::string_view bytes, const std::filesystem::path& path);

/// Decodes the primary image, upright, to 8 bits of RGB per pixel, row by row. Colours stay coded
/// as they are, as those of a JPEG with a profile do.
/// \throws BadInput Syntax; LimitError
std::string decode_heif(std::string_view bytes, const std::filesystem::path& path);

/// The Exif part of the primary image as libexif takes it; empty where there is none. Its
/// orientation is not to be applied: the container has one of its own.
/// \throws BadInput Syntax; LimitError
std::string heif_exif(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
