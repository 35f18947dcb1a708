// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/model/memory_plan.h"
#include "convert/model/model.h"
#include "convert/model/model_training.h"
#include "convert/model/water_report.h"
#include "convert/scene/marker_bars.h"
#include "convert/scene/scene_request.h"
#include "convert/text/report_json.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"

namespace cgs {

namespace {

struct TrainArgs {
  SceneRequest scene;
  std::filesystem::path output;
  TrainingArguments training;
  Medium medium = Medium::None;
  std::filesystem::path start;
  bool overwrite = false;
  CommonOptions common;
};

// Given splats are refined as free ones: they belong to no pixel.
TrainingOptions options_of(const TrainArgs& args) {
  TrainingOptions options = training_options(args.training);
  if (args.start.empty()) return options;
  if (options.method != SplatMethod::Classical) {
    throw InvalidInput("--start refines splats that are free: it goes with --preset classical");
  }
  if (!is_present(args.start)) throw BadInput(Defect::Open, args.start, "no such file");
  return options;
}

// The scale that was measured, which becomes that of the model; null where none was.
nlohmann::ordered_json settle_scale(const OpenedScene& opened,
                                    const std::vector<KnownDistance>& distances,
                                    const std::vector<MarkerBar>& markers,
                                    Model& model,
                                    const Terminal& terminal) {
  nlohmann::ordered_json scale;
  if (opened.control) {
    scale = control_to_json(*opened.control);
  } else if (const auto by_distances = scale_by(distances, markers, model)) {
    terminal.warn(by_distances->warnings);
    scale = distances_to_json(*by_distances);
  }
  widen_by_focal(model.scene.frame, opened.focal_sigma());
  if (scale.is_object()) scale["metres_sigma"] = model.scene.frame.metres_sigma;
  return scale;
}

void run_train(const TrainArgs& args) {
  limit_threads(args.common.threads);
  keep_scene_apart(args.output, args.scene.path, {"priors", "colmap"});
  refuse_to_replace_model(args.output, args.overwrite);
  Terminal terminal(args.common.quiet, args.common.strict);
  std::vector<std::string> checkpoint_warnings;
  std::vector<KnownDistance> distances;
  const ModelRequest request = {
      {},
      options_of(args),
      args.output,
      args.scene.options.depth.network,
      !args.overwrite,
      [&](const Model& model, const PriorsReport& priors) {
        check_picks(distances, model);
        terminal.note(coverage_words(priors, model.scene));
      },
      [&](const std::string& words) { checkpoint_warnings.push_back(words); },
      args.medium,
      args.start};
  const size_t budget = memory_budget(stated_memory_limit(args.common));
  const NewFolder folder(args.output);
  const FolderLock lock(args.output);
  refuse_to_replace_model(args.output, args.overwrite);  // another start may have ended since
  const auto keep = [&](const OpenedScene& solved) { solved.keep(args.output); };
  OpenedScene opened = open_scene(args.scene, args.output, terminal, keep);
  check_training_memory(opened.scene, budget, request.training);
  (void)check_stated_cameras(opened, terminal);
  remove_abandoned_files(args.output);
  opened.keep(args.output);
  Scene& scene = opened.scene;
  distances = known_distances(args.scene.known_distances, scene);
  const auto markers = marker_bars(scene, args.scene.marker_size);
  const size_t known = scene.warnings.size();
  terminal.note(scene.notes);
  terminal.warn(scene.warnings);
  TrainedModel trained =
      train_model(std::move(scene), request, terminal.begin(traits(Stage::Model).title));
  const std::vector<std::string>& warnings = trained.model.scene.warnings;
  const std::vector<std::string> found(warnings.begin() + static_cast<std::ptrdiff_t>(known),
                                       warnings.end());
  nlohmann::ordered_json report = training_to_json(trained, request);
  write_model(args.output, trained.model);  // first, as a distance may be refused
  if (opened.refined) report["refined_poses"] = refinement_to_json(opened.refined->report);
  report["scale"] = settle_scale(opened, distances, markers, trained.model, terminal);
  const Frame& frame = trained.model.scene.frame;
  if (frame.has_metric_scale()) (void)restate_frame(args.output, trained.model);
  if (trained.water) report["water"] = water_to_json(*trained.water, frame);
  write_file(args.output / "training.json", json_text(versioned(report)) + "\n");
  forget_checkpoints(args.output);
  const size_t count = trained.model.gaussians.size();
  report["seconds"] = terminal.end(std::to_string(count) + " Gaussians");
  const std::string& depth = trained.priors.given.found;
  if (!depth.empty()) terminal.say("depth files: " + depth);
  for (const std::string& remark : remarks_on_photographs(report)) terminal.say(remark);
  if (args.common.json) print_report(report);
  terminal.warn(found);
  terminal.warn(checkpoint_warnings);
}

}  // namespace

void add_train(CLI::App& app) {
  auto args = std::make_shared<TrainArgs>();
  auto* cmd = app.add_subcommand("train", "Photographs to coherent Gaussians (a model folder)");
  cmd->add_option("scene", args->scene.path, "Folder of a scene, as for run")->required();
  cmd->add_option("-o,--output", args->output, "Model folder to write")->required();
  add_scene_options(*cmd, args->scene.options);
  add_camera_options(*cmd, args->scene);
  add_scale_options(*cmd, args->scene);
  add_medium_option(*cmd, args->medium);
  add_training_options(*cmd, args->training);
  cmd->add_option("--start",
                  args->start,
                  "With --preset classical: splats to begin from and refine, in the coordinates of "
                  "the scene, of any format that convert reads; their number stays");
  cmd->add_flag("-w,--overwrite", args->overwrite, "Replace a finished model");
  add_common_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs train photos/portal --views 1,10,19 --preset draft -o out/model\n"
      "         cgs train photos/portal --preset classical --start splats.ply -o out/refined\n"
      "Interrupted, it goes on where it was when it is run again; with --preset classical it "
      "begins "
      "anew.");
  cmd->callback([args] { run_train(*args); });
}

}  // namespace cgs
