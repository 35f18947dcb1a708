// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/ply/header.h"
#include "io/splats/raw_splats.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// True if a PLY header declares splats packed in chunks of 256.
bool is_compressed_ply(const PlyHeader& header);

/// Reads the packed PLY of PlayCanvas and SuperSplat: an element `chunk` with the ranges of
/// position, log scale and (in newer files) colour of 256 splats each, an element `vertex` with
/// four packed 32-bit numbers, and perhaps an element `sh` with a byte per coefficient.
///
/// \throws BadInput as parse_ply_header() and read_ply_rows(); Schema (a property is missing),
///         Count (too few chunks, or not one row of `sh` per splat), Empty; LimitError
/// Source: PlayCanvas, splat-transform, the compressed.ply of its reader and writer.
RawSplats parse_compressed_ply(std::string_view bytes, const std::filesystem::path& path);

struct CompressedPlyReport {
  size_t bytes = 0;
  std::vector<uint32_t> order;  ///< Index of the Gaussian that became splat i of the file.
  uint64_t clamped = 0;         ///< Splats with a harmonic beyond +-4.
};

/// Writes the packed PLY that parse_compressed_ply() reads, in file coordinates, along a Morton
/// curve so that the 256 splats of a chunk lie close together.
///
/// A coordinate or log scale is off by up to half of 1/2047 (y: 1/1023) of the range of its chunk,
/// a colour by half of 1/255 of it, opacity by 1/510, a harmonic by 1/64 (1/32 at the ends), a
/// rotation by three parts in a thousand.
/// \param evidence  as write_gaussian_ply()
/// \throws InvalidInput as write_gaussian_ply(); IoError
CompressedPlyReport write_compressed_ply(const std::filesystem::path& path,
                                         const Gaussians& gaussians,
                                         const Frame& frame,
                                         const std::string& evidence = {});

}  // namespace cgs
