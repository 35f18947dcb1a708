// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "convert/run/run_request.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The stage of a run from model to meshes: writes volume.vdb and mesh/ (all but the OBJ) below
/// request.output. \return "mesh" of the report.
nlohmann::ordered_json write_meshes(const Model& model,
                                    const RunRequest& request,
                                    const Progress& progress);

/// The watertight mesh of a run, in a frame. \throws BadInput
TriangleMesh read_watertight(const std::filesystem::path& output, const Frame& frame);

/// The stage from model and watertight mesh to what photographs texture: writes web/ and
/// mesh/watertight.obj below request.output.
/// \param description  of the model, for asset.glb
/// \param mesh_report  "certificate" and "simplification" as write_meshes() returned them
/// \return "web" of the report.
nlohmann::ordered_json write_assets(const Model& model,
                                    const TriangleMesh& mesh,
                                    const RunRequest& request,
                                    const nlohmann::ordered_json& description,
                                    const nlohmann::ordered_json& mesh_report,
                                    const Progress& progress);

}  // namespace cgs
