// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"
#include "libcgs/render/virtual_cameras.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

/// How splats that came without cameras become a volume.
struct SplatVolumeRequest {
  VirtualCameraOptions cameras;
  std::string voxel_size;   ///< As typed; empty = from the pixel footprint.
  size_t memory_limit = 0;  ///< [bytes]; 0 = 80 % of what is free.
};

struct SplatVolume {
  FusedVolume fused;  ///< Support is 0 throughout: nobody observed it.
  VirtualCameras cameras;
  size_t left_out = 0;   ///< Splats outside the scene that would hide it from the cameras.
  size_t two_sided = 0;  ///< Pixels on sheets that are seen from both sides.
};

/// Looks at splats from virtual cameras and fuses the depth at which half the light is stopped.
/// Pixels that nearly all light passes are known to be free: there is nothing but these splats.
///
/// Splats have no inside: a sheet of them shows the same surface to both sides. Where cameras on
/// either side agree on one, it becomes a plate, three voxels thick.
/// \throws InvalidInput, LimitError as virtual_cameras() and fuse(); NumericalError if no picture
///         shows a surface
SplatVolume splat_volume(Gaussians gaussians,
                         const Frame& frame,
                         const SplatVolumeRequest& request,
                         const Progress& progress);

/// The figures for a report, in file units.
nlohmann::ordered_json splat_volume_to_json(const SplatVolume& volume, const Frame& frame);

}  // namespace cgs
