// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/tradeoff_stages.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/evaluation.h"
#include "convert/model/model_training.h"
#include "convert/model/views.h"
#include "convert/run/run_stages.h"
#include "convert/run/stage_cost.h"
#include "convert/scene/scene_request.h"
#include "io/bytes/atomic_file.h"

namespace cgs {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

namespace {

Json cost_json(const CostMeter& meter) {
  const StageCost cost = meter.read();
  return {{"cpu", cost.cpu}, {"wall", cost.wall}, {"peak_memory", cost.peak_memory}};
}

// The scene and model of a setting see the held-out views at the size of the standard setting:
// smaller photographs are easier, so settings would not compare.
void show_held_out_as(const Scene& standard, Scene& scene) {
  for (const int i : scene.held_out) {
    Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    const Eigen::Isometry3d pose = camera.world_from_cam;
    camera = standard.views[static_cast<size_t>(i)].camera;
    camera.world_from_cam = pose;
  }
}

}  // namespace

Json make_model(const RunRequest& request,
                const fs::path& poses,
                const Scene& standard,
                const Progress& progress) {
  fs::remove_all(request.output);
  const CostMeter meter;
  Terminal silent(true);
  Scene scene = open_scene(request.scene, poses, silent).scene;
  const ModelRequest training = {{}, request.training, {}, request.scene.options.depth.network};
  const TrainedModel trained = train_model(std::move(scene), training, part_of(progress, 0, 0.85));
  write_model(request.output, trained.model);
  Model model = read_model(request.output);
  write_views(model,
              views_with_photograph(model.scene),
              request.output / "views",
              part_of(progress, 0.85, 0.95));
  Json out = {{"cost", cost_json(meter)},
              {"description", training_to_json(trained, training).at("description")},
              {"bytes", fs::file_size(request.output / "gaussians.ply")},
              {"evaluation", nullptr}};
  fs::remove_all(request.output / "views");
  if (model.scene.held_out.empty()) return out;
  show_held_out_as(standard, model.scene);
  out["evaluation"] =
      figures_to_json(evaluate_views(model, model.scene.held_out, part_of(progress, 0.95, 1)).mean);
  return out;
}

Json make_meshes(const fs::path& model_folder,
                 const RunRequest& request,
                 const Progress& progress) {
  fs::remove_all(request.output);
  const Model model = read_model(model_folder);
  make_output_folder(request.output);
  const CostMeter meter;
  const MeshesReport report = write_meshes(model, request, progress);
  const Frame& frame = model.scene.frame;
  Json out = {{"cost", cost_json(meter)},
              {"voxel", report.fusion.voxel_size * frame.scale},
              {"certificate", report.certificate},
              {"simplification", simplification_to_json(report.simplification, frame)},
              {"bytes", fs::file_size(request.output / "mesh/watertight.ply")}};
  fs::remove(request.output / "volume.vdb");
  for (const auto& entry : fs::directory_iterator(request.output / "mesh")) {
    if (entry.path().filename() != "watertight.ply") fs::remove(entry.path());
  }
  return out;
}

Json make_assets(const fs::path& model_folder,
                 const fs::path& mesh_folder,
                 const RunRequest& request,
                 const std::string& description,
                 const Json& meshes,
                 const Progress& progress) {
  fs::remove_all(request.output);
  const Model model = read_model(model_folder);
  const TriangleMesh mesh = read_watertight(mesh_folder, model.scene.frame);
  make_output_folder(request.output / "mesh");
  const CostMeter meter;
  const Frame& frame = model.scene.frame;
  const AssetsReport report =
      write_assets(model, mesh, request, description, mesh_findings(meshes, frame), progress);
  const DeviationStep& off_mesh = report.deviation;
  Json out = {{"cost", cost_json(meter)},
              {"bytes", report.asset.glb.bytes},
              {"error", off_mesh.has_evidence ? off_mesh.with_evidence.p95 * frame.scale : 0.0}};
  fs::remove_all(request.output);
  return out;
}

}  // namespace cgs
