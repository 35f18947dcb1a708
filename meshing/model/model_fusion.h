// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/reconstruct/model.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

/// Which estimated surface goes into a volume, and so into the meshes made of it.
enum class EstimatedSurface {
  Keep,      ///< All.
  FillOnly,  ///< Where it is small and framed by evidence: framed_estimates().
  Drop       ///< None.
};

/// How fuse_model() fuses.
struct ModelFusion {
  double voxel_size = 0;  ///< Edge [internal units]; 0 = chosen, as in TsdfOptions.
  EstimatedSurface estimated = EstimatedSurface::FillOnly;
  size_t memory_limit = TsdfOptions().memory_limit;  ///< [bytes]
  double coarsest_voxel = 0;                         ///< As in TsdfOptions [internal units].
  int64_t max_voxels = TsdfOptions().max_voxels;     ///< In the bounds, where voxels are chosen.
};

/// Fuses what the input views of a model see: measured depth, coloured as the Gaussians draw it.
/// Through sky they see that nothing is there. Needs no photographs.
/// \pre model.priors are those of model.scene.input, in their order
/// \throws as fuse()
FusedVolume fuse_model(const Model& model,
                       const ModelFusion& request,
                       const Progress& progress = {});

}  // namespace cgs
