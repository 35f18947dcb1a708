// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "convert/run/run_request.h"
#include "libcgs/core/progress.h"

namespace cgs {

// The stages of `cgs run` with their cost, each in a folder of its own, request.output, which is
// emptied first. Only what a later stage reads is kept. Each returns {"cost": {"cpu" [s], "wall"
// [s], "peak_memory" [bytes]}, "bytes" of its main file, …}; reading what the stage before wrote
// and measuring quality are no part of the cost.

/// Photographs to model and views. {…, "description", "evaluation": {"psnr", "ssim", "psnr_seen",
/// "ssim_seen", …}}: of held-out views at the size they have in `standard`, as smaller photographs
/// are easier; null if there is none.
/// \param poses  folder where solved cameras are stored
nlohmann::ordered_json make_model(const RunRequest& request,
                                  const std::filesystem::path& poses,
                                  const Scene& standard,
                                  const Progress& progress);

/// Model to volume and meshes, of which the watertight one is kept. {…, "voxel" [scene units],
/// "certificate", "simplification"}
nlohmann::ordered_json make_meshes(const std::filesystem::path& model_folder,
                                   const RunRequest& request,
                                   const Progress& progress);

/// Model and watertight mesh to what a web page shows. {…, "error": 95 % of the surface with
/// evidence are off the watertight mesh by less [scene units]}
/// \param description  as write_assets() takes it
/// \param meshes       what make_meshes() returned
nlohmann::ordered_json make_assets(const std::filesystem::path& model_folder,
                                   const std::filesystem::path& mesh_folder,
                                   const RunRequest& request,
                                   const std::string& description,
                                   const nlohmann::ordered_json& meshes,
                                   const Progress& progress);

}  // namespace cgs
