// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "io/splats/raw_splats.h"

namespace cgs {

/// True for a ZIP archive, which is what a .sog file is, and for the meta.json of one that is
/// unpacked: JSON with the keys means, quats and sh0.
bool looks_like_sog(std::string_view bytes);

/// What a SOG file says of its size.
struct SogCount {
  uint64_t splats = 0;     ///< As stated, but no more than its first picture has pixels.
  uint64_t harmonics = 1;  ///< RGB coefficients of each.
};

/// What meta.json says, with the size of the picture of the positions.
/// \throws BadInput as parse_sog()
SogCount stated_sog_splats(std::string_view bytes, const std::filesystem::path& path);

/// Reads SOG, version 2: meta.json and lossless WebP images whose pixels are the quantised
/// attributes of one splat each, in a ZIP archive or, where the bytes are those of meta.json,
/// beside it.
///
/// \throws BadInput as ZipArchive, parse_json() and, for files beside meta.json, resolve_beside()
///         and read_file(); Schema (a key is missing or has another type), Unsupported (another
///         version; images of another format), Empty (no splats), Count (an image is too small),
///         Value (codebooks not finite), Syntax (an image cannot be decoded); LimitError
/// Source: PlayCanvas, "The SOG format", version 2.
RawSplats parse_sog(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
