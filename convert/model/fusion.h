// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/model/model.h"
#include "libcgs/core/progress.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

/// Which estimated surface goes into a volume, and so into the meshes made of it.
enum class EstimatedSurface {
  Keep,      ///< All.
  FillOnly,  ///< Where it is small and framed by evidence: framed_estimates().
  Drop       ///< None.
};

/// By their names on the command line: keep, fill-only, drop.
std::map<std::string, EstimatedSurface> estimated_surfaces();

struct ModelFusion {
  std::string voxel_size;  ///< As in RunRequest.
  EstimatedSurface estimated = EstimatedSurface::FillOnly;
  size_t memory_limit = 0;    ///< [bytes]; 0 = 80 % of what is free.
  double coarsest_voxel = 0;  ///< As in TsdfOptions.
};

/// Fuses what the input views of a model see. Through sky they see that nothing is there.
FusedVolume fuse_model(const Model& model, const ModelFusion& request, const Progress& progress);

/// The figures of a fusion for a report, in file units.
nlohmann::ordered_json fusion_to_json(const TsdfReport& report, const Frame& frame);

}  // namespace cgs
