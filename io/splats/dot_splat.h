// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "io/splats/raw_splats.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// True if the bytes can be records of a .splat file, which has no header: a multiple of 32 bytes,
/// whose first records hold numbers that positions and scales can be.
bool looks_like_dot_splat(std::string_view bytes);

/// Reads a .splat file: per splat float x y z, float scale 0 1 2 (lengths), bytes red green blue
/// opacity and a quaternion (w, x, y, z) as 128 + 128 q. It has no further spherical harmonics.
///
/// \throws BadInput Truncated (not a multiple of 32 bytes)
/// Source: antimatter15/splat, the files its converter makes.
RawSplats parse_dot_splat(std::string_view bytes, const std::filesystem::path& path);

/// What did not fit into bytes.
struct DotSplatReport {
  size_t bytes = 0;
  uint64_t clamped_colors = 0;  ///< Splats with a colour outside [0, 1].
  bool dropped_sh = false;      ///< Spherical harmonics above degree 0 were left out.
};

/// Writes a .splat file in file coordinates.
/// \throws InvalidInput as write_gaussian_ply(), or if looks_like_dot_splat() would not know the
///         file again; IoError
DotSplatReport write_dot_splat(const std::filesystem::path& path,
                               const Gaussians& gaussians,
                               const Frame& frame);

}  // namespace cgs
