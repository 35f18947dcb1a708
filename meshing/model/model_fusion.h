// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "libcgs/core/frame.h"
#include "libcgs/core/progress.h"
#include "libcgs/reconstruct/model.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

/// Which estimated surface goes into a volume, and so into the meshes made of it.
enum class EstimatedSurface {
  Keep,      ///< All.
  FillOnly,  ///< Where it is small and framed by evidence, see framed_estimates(), or ground or a
             ///< wall that goes on, see continue_planes().
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

/// Models of one world, such as groups of the photographs of a large scene, each in a frame of its
/// own. They are read when they are asked for: several times, one at a time, from any thread.
struct ModelSource {
  size_t count = 0;
  std::function<std::shared_ptr<const Model>(size_t i)> model;
};

struct JoinedVolume {
  FusedVolume fused;
  Frame frame;             ///< Of the first model: what the volume is in.
  size_t photographs = 0;  ///< That were fused.
  size_t in_several = 0;   ///< Of these, input views of more than one model.
};

/// Fuses what the input views of several models see into one volume: what fuse_model() gives for a
/// model that holds them all. Of a photograph that is in several, the model counts that measured
/// more of it, for it is one witness. Views are of one photograph if name and camera are the same.
///
/// No more than two models are held at once where they are asked for one after the other.
/// \throws InvalidInput if there is no model, or their units differ; as fuse()
JoinedVolume fuse_models(const ModelSource& source,
                         const ModelFusion& request,
                         const Progress& progress = {});

}  // namespace cgs
