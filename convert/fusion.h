// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/model.h"
#include "libcgs/core/progress.h"
#include "meshing/tsdf.h"

namespace cgs {

/// Fuses what the input views of a model see. `voxel_size` as in RunRequest; `coarsest_voxel` as in
/// TsdfOptions.
FusedVolume fuse_model(const Model& model,
                       const std::string& voxel_size,
                       size_t memory_limit,
                       const Progress& progress,
                       double coarsest_voxel = 0);

/// The figures of a fusion for a report, in file units.
nlohmann::ordered_json fusion_to_json(const TsdfReport& report, const Frame& frame);

}  // namespace cgs
