// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "io/splats/splat_doctor.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// Writes Gaussians in the 3DGS layout: binary little-endian PLY, all float32 properties x y z,
/// nx ny nz (0), f_dc_0..2, f_rest_* (channel-major; 0, 9, 24 or 45 of them by degree), opacity
/// (logit), scale_0..2 (natural log of world units), rot_0..3 (w, x, y, z); and after these, where
/// the Gaussians state it, provenance (the number of the label); and where some are made up,
/// synthetic (0 = not, else the number of its picture).
///
/// Positions are file coordinates; comments carry unit, scale source and origin, and "synthetic
/// NUMBER sha256:HASH FILE" for each picture of which Gaussians were made up.
/// \param evidence  what the Gaussians rest on, in words, for a comment; empty = nobody says
/// \throws InvalidInput if an array does not fit, or a value is not finite or out of its range;
///         IoError
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting", files of the reference implementation.
void write_gaussian_ply(const std::filesystem::path& path,
                        const Gaussians& gaussians,
                        const Frame& frame,
                        const std::string& evidence = {});

/// Writes anew what the header of a file of write_gaussian_ply() tells of its frame; the splats
/// keep their bytes, and the evidence its words.
/// \return false if another program wrote the file, which is left alone
/// \throws BadInput; IoError
bool restate_gaussian_ply(const std::filesystem::path& path, const Frame& frame);

/// Reads the 3DGS layout, ASCII or binary, properties in any order and of any type, others ignored.
///
/// Normals and f_rest_* may be absent; degree 4 is read as degree 3. Without scale_2 (2DGS) splats
/// become a thousandth of their smaller width thick. Colour may be red, green, blue (or
/// diffuse_red …, or r, g, b; floats up to 1 or 255) instead of f_dc_*. Labels of provenance and
/// tags of what is made up are read where there are any, from whole numbers of any type.
/// \throws BadInput as parse_ply_header() and read_ply_rows(); Schema (a property is missing, or
///         the number of f_rest_* is none of the five), Empty (0 vertices); LimitError
RawSplats parse_gaussian_ply(std::string_view bytes, const std::filesystem::path& path);

/// The same from a file, judged by examine_splats().
GaussianFile read_gaussian_ply(const std::filesystem::path& path,
                               const std::optional<Frame>& frame = {});

}  // namespace cgs
