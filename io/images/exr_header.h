// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// What screen_exr() found.
struct ExrScreening {
  /// A scanline image, compressed with NONE, RLE, ZIPS or ZIP, whose chunks lie inside the file,
  /// one per block of lines. In the decoders of everything else older releases of the library have
  /// known defects: it must not be decoded in this process.
  bool is_harmless = false;
  /// All channels as 32-bit floats; of a tile if that is larger than the image.
  uint64_t decoded_bytes = 0;
};

/// Lets pass only what the OpenEXR library may see, in a child process if it is not harmless: a
/// single-part flat image of bounded size without subsampled channels.
/// \throws BadInput, LimitError as read_exr()
ExrScreening screen_exr(std::string_view bytes,
                        const std::filesystem::path& path,
                        const ReadLimits& limits);

}  // namespace cgs
