// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/byte_reader.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// True for names of depth maps of COLMAP's dense stereo, *.geometric.bin and *.photometric.bin:
/// z-depth in units of the cameras, of pictures without distortion.
bool is_colmap_depth_name(const std::filesystem::path& path);

/// The depth map of a photograph: NAME.geometric.bin, which views agree on, else
/// NAME.photometric.bin; empty if there is none. Names in COLMAP begin below its image folder, so
/// those of rigs are looked for with their folders first.
/// \param folder  in which links must not lead elsewhere unless allow_external
/// \throws BadInput Path
std::filesystem::path colmap_depth_of(const SceneRoot& folder,
                                      const std::filesystem::path& photograph);

/// Reads such a map as it is; 0 where there is no depth.
/// \throws BadInput Open, Empty, Syntax (the text "width&height&1&"), Schema (several values per
///         pixel, as in normal maps), Count (another number of values than it declares); LimitError
/// Source: COLMAP 3.8, src/mvs/mat.h, Mat<T>::Write.
Raster<float> read_colmap_depth(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace cgs
