// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/files/mesh_files.h"
#include "convert/model/model.h"
#include "convert/model/simplification.h"
#include "convert/model/texture.h"
#include "convert/run/asset.h"
#include "convert/run/deviation_ledger.h"
#include "convert/run/run_request.h"
#include "convert/run/written_surface.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

/// What files of meshes are once they are read again.
struct FileDeviations {
  std::map<std::string, double> largest;  ///< Distance from what was fused [internal units].
  std::vector<std::string> too_large;     ///< Files that are above what is read of their format.
};

/// How the files keep request.max_error.
struct MeshPromise {
  double length = 0;  ///< [internal units]
  FileDeviations files;
  KnownArea known;  ///< To that length.
};

/// What the stage of the meshes did.
struct MeshesReport {
  TsdfReport fusion;
  std::string method;                  ///< Of WatertightResult.
  nlohmann::ordered_json certificate;  ///< As certificate_to_json(), for files that state it.
  std::optional<Simplification> simplification;
  std::optional<MeshPromise> promise;
  std::vector<DeviationStep> deviations;
  size_t open_surface_faces = 0;
  MeshFiles files;
};

/// "mesh" of the report of a run.
nlohmann::ordered_json meshes_to_json(const MeshesReport& report, const Frame& frame);

/// What later stages take of a MeshesReport.
struct MeshFindings {
  double simplified = 0;  ///< Largest error of simplification [internal units]; 0 = there was none.
  nlohmann::ordered_json certificate;
};

/// Takes it from what meshes_to_json() made of it: a resumed run must give the bits of one that was
/// not interrupted.
/// \throws nlohmann::json::exception
MeshFindings mesh_findings(const nlohmann::ordered_json& report, const Frame& frame);

/// The stage of a run from model to meshes: writes volume.vdb and mesh/ (all but the OBJ) below
/// request.output.
MeshesReport write_meshes(const Model& model, const RunRequest& request, const Progress& progress);

/// The watertight mesh of a run, in a frame.
/// \throws BadInput
TriangleMesh read_watertight(const std::filesystem::path& output, const Frame& frame);

/// What the stage of the assets did.
struct AssetsReport {
  TextureReport texture;
  DeviationStep deviation;  ///< What simplification for asset.glb and its compression move, told by
                            ///< the file itself.
  WrittenAsset asset;
};

/// "web" of the report of a run.
nlohmann::ordered_json assets_to_json(const AssetsReport& report, const Frame& frame);

/// The stage from model and watertight mesh to what photographs texture: writes web/ and
/// mesh/watertight.obj below request.output.
/// \param description  of the model, for asset.glb
AssetsReport write_assets(const Model& model,
                          const TriangleMesh& mesh,
                          const RunRequest& request,
                          const std::string& description,
                          const MeshFindings& findings,
                          const Progress& progress);

}  // namespace cgs
