// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// Writes Gaussians in the 3DGS layout: binary little-endian PLY, all float32 properties x y z,
/// nx ny nz (0), f_dc_0..2, f_rest_* (channel-major; 0, 9, 24 or 45 of them by degree), opacity
/// (logit), scale_0..2 (natural log of world units), rot_0..3 (w, x, y, z).
///
/// Positions are file coordinates; comments carry unit, scale source and origin.
/// \throws InvalidInput if an array does not fit, or a value is not finite or out of its range;
///         IoError
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting", files of the reference implementation.
void write_gaussian_ply(const std::filesystem::path& path,
                        const Gaussians& gaussians,
                        const Frame& frame);

/// Gaussians from a file and the frame they were read into.
struct GaussianFile {
  Gaussians gaussians;
  Frame frame;
  std::vector<std::string> warnings;  ///< One line each: what was dropped, clamped, or looks odd.
};

/// Reads the 3DGS layout, ASCII or binary, with or without normals, of any degree up to 3.
///
/// Gaussians with a value that is not finite, without rotation, of opacity 0, or too wide for float
/// are dropped; opacity 1 becomes 0.99 and vanishing scales the smallest that can be squared. Both
/// are counted in warnings. Quaternions are normalised.
/// \param frame  read into exactly this frame; without it a canonical frame is made from the 1st
///               to 99th percentile of the positions, so that stray splats do not shrink the scene,
///               with unit and origin from the comments
/// \throws BadInput as parse_ply_header() and read_ply_rows(); Schema (a property is missing, or
/// the
///         number of f_rest_* is none of the four), Unsupported (2D splats, without scale_2), Empty
///         (0 vertices), Value (no finite splat); LimitError
GaussianFile read_gaussian_ply(const std::filesystem::path& path,
                               const std::optional<Frame>& frame = {});

}  // namespace cgs
