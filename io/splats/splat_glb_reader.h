// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "io/splats/raw_splats.h"

namespace cgs {

/// What the default scene of a glTF file states to hold.
struct GlbSplatCount {
  uint64_t splats = 0;         ///< KHR_gaussian_splatting
  uint64_t harmonics = 1;      ///< RGB coefficients of each.
  bool has_triangles = false;  ///< Beside them.
};

/// \throws BadInput as GlbContainer, glb_scene() and stated_spz_splats(); LimitError
GlbSplatCount count_glb_splats(const std::filesystem::path& path);

/// True for a glTF file that shows splats and no triangles: what shows both is a mesh.
/// \throws BadInput as count_glb_splats(); LimitError
bool is_splat_glb(const std::filesystem::path& path);

/// Reads every splat of the default scene of a glTF file, nodes placed as the file says:
/// they turn, scale and mirror splats and their spherical harmonics too (harmonics are only turned
/// where a node scales its axes differently). Attributes may be floats or whole numbers, named as
/// the extension or its drafts have it, or compressed with SPZ; _PROVENANCE is read where it is one
/// number per splat, and NaN for splats of primitives without it.
///
/// Files of ours lead back to world coordinates, with unit and origin. Others are in metres with +Y
/// up, as the format demands, and are turned half way around z, into the axes of the 3DGS PLY.
/// Colours in linear light become sRGB: exact for the mean colour of a splat, to first order
/// for what depends on direction, with a note.
///
/// \param content  of the file, binary or text
/// \throws BadInput as GlbContainer, glb_scene() and parse_spz(); Empty without splats; Schema for an
///         attribute that is missing or a primitive of no points; Count for attributes of different
///         lengths; Value for a node that flattens them;
///         LimitError for more than 2^26 splats, or 2^28 coefficients of their colours
/// Source: Khronos Group, KHR_gaussian_splatting and KHR_gaussian_splatting_compression_spz_2.
RawSplats parse_splat_glb(std::string content, const std::filesystem::path& path);

}  // namespace cgs
