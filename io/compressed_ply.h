// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "io/ply_header.h"
#include "io/raw_splats.h"

namespace cgs {

/// True if a PLY header declares splats packed in chunks of 256.
bool is_compressed_ply(const PlyHeader& header);

/// Reads the packed PLY of PlayCanvas and SuperSplat: an element `chunk` with the ranges of
/// position, log scale and (in newer files) colour of 256 splats each, an element `vertex` with
/// four packed 32-bit numbers, and perhaps an element `sh` with a byte per coefficient.
///
/// \throws BadInput as parse_ply_header() and read_ply_rows(); Schema (a property is missing),
/// Count
///         (too few chunks, or not one row of `sh` per splat), Empty; LimitError
/// Source: PlayCanvas, splat-transform, the compressed.ply of its reader and writer.
RawSplats parse_compressed_ply(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
