// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "io/byte_reader.h"

namespace cgs {

/// Lets pass only what the OpenEXR library may see: a single-part flat scanline image of bounded
/// size, compressed with NONE, RLE, ZIPS or ZIP, whose chunks lie inside the file, one per block of
/// lines.
///
/// Older releases of the library have known defects in everything else.
/// \throws BadInput, LimitError as read_exr()
void screen_exr(std::string_view bytes,
                const std::filesystem::path& path,
                const ReadLimits& limits);

}  // namespace cgs
