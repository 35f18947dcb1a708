// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/pipeline.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/evaluation.h"
#include "convert/model/memory_plan.h"
#include "convert/model/model.h"
#include "convert/model/model_training.h"
#include "convert/model/stage.h"
#include "convert/model/views.h"
#include "convert/model/water_report.h"
#include "convert/report/report.h"
#include "convert/report/report_viewer.h"
#include "convert/run/disk_plan.h"
#include "convert/run/readable_inputs.h"
#include "convert/run/request_fields.h"
#include "convert/run/run_files.h"
#include "convert/run/run_record.h"
#include "convert/run/run_stages.h"
#include "convert/run/stage_cost.h"
#include "convert/run/web_splats.h"
#include "convert/scene/marker_bars.h"
#include "convert/text/frame_json.h"
#include "convert/text/report_json.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "libcgs/core/error.h"
#include "libcgs/core/photograph_cache.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

/// One run: the request, what is in memory so far, and the record on disk.
struct Run {
  const RunRequest& request;
  std::vector<StageFiles> stages;
  RunRecord record;
  Scene scene;  ///< As opened: world coordinates.
  std::vector<KnownDistance> distances;
  std::vector<MarkerBar> markers;
  std::optional<ControlReport> control;  ///< Of OpenedScene.
  Json refined;        ///< As refinement_to_json(); null where it was not asked for.
  double focal_sigma;  ///< Of OpenedScene.
  // What the files of finished stages hold, read when a stage needs it. Never what a stage had in
  // memory when it wrote them: a resumed run must give the bits of one that was not interrupted.
  std::optional<Model> model;
  std::optional<TriangleMesh> mesh;   ///< Watertight.
  std::vector<std::string> warnings;  ///< Of the stage that runs, for the terminal alone.
  const Terminal& terminal;           ///< For what must be said before a stage ends.
};

bool is_done(const Run& run, const StageFiles& stage) {
  return run.record.is_done(traits(stage.stage).name, stage.files);
}

Json result_of(const Run& run, Stage stage) { return run.record.result(traits(stage).name); }

size_t most_memory(const std::vector<StageMemory>& plan) {
  size_t most = 0;
  for (const StageMemory& stage : plan) most = std::max(most, stage.bytes);
  return most;
}

// What photographs may be kept in [bytes]: some of what no stage needs.
size_t spare_memory(const std::vector<StageMemory>& plan, size_t budget) {
  return std::min(kKeptPhotographs, budget - std::min(budget, most_memory(plan)));
}

Json memory_to_json(const std::vector<StageMemory>& plan) {
  Json out = Json::object();
  for (const StageMemory& stage : plan) out[traits(stage.stage).title] = stage.bytes;
  return out;
}

Model& loaded_model(Run& run) {
  if (!run.model) {
    run.model = read_model(run.request.output / "model");
    relink_views(run.model->scene, run.scene);  // masks and paths may have changed since
  }
  return *run.model;
}

const TriangleMesh& loaded_mesh(Run& run) {
  if (!run.mesh) {
    run.mesh = read_watertight(run.request.output, loaded_model(run).scene.frame);
  }
  return *run.mesh;
}

/// What a stage did.
struct StageResult {
  Json report = {};         ///< Goes into run.json.
  std::string remark = {};  ///< What a user would not expect of it: "kept 33165 of 142884".
  /// Files that it left out, below the folder of the run: those of another program may stand there.
  std::vector<std::string> left_out = {};
};

StageResult run_model(Run& run, const Progress& progress) {
  const std::filesystem::path folder = run.request.output / "model";
  ModelRequest request = {
      {}, run.request.training, folder, run.request.scene.options.depth.network};
  request.inspect = [&](const Model& model, const PriorsReport& priors) {
    check_picks(run.distances, model);
    run.terminal.note(coverage_words(priors, model.scene));
  };
  request.medium = run.request.medium;
  request.warn = [&](const std::string& words) { run.warnings.push_back(words); };
  const TrainedModel trained = train_model(run.scene, request, progress);
  // Pixels were read for the first time: more may be odd than the cameras told.
  const std::vector<std::string>& found = trained.model.scene.warnings;
  Json report = training_to_json(trained, request);
  report["warnings"] = std::vector<std::string>(
      found.begin() + static_cast<std::ptrdiff_t>(run.scene.warnings.size()), found.end());
  write_model(folder, trained.model);
  write_file(folder / "training.json", json_text(versioned(report)) + "\n");
  const GivenDepthReport& given = trained.priors.given;
  std::string remark = given.kind == DepthKind::Unknown ? "" : "depth files: " + given.found;
  for (const std::string& words : remarks_on_photographs(report)) {
    remark += (remark.empty() ? "" : "; ") + words;
  }
  return {report, remark};
}

// The scale is told apart from the model: people learn a length after they saw a first result.
StageResult run_scale(Run& run, const Progress& progress) {
  Model model = read_model_as_written(run.request.output / "model");
  relink_views(model.scene, run.scene);
  report(progress, 0);
  Frame& frame = model.scene.frame;
  const Frame before = frame;
  frame.metres_per_unit = run.scene.frame.metres_per_unit;
  frame.metres_sigma = run.scene.frame.metres_sigma;
  frame.scale_source = run.scene.frame.scale_source;
  frame.up = run.scene.frame.up;
  take_sensor_scale(recorded_sensor_scale(result_of(run, Stage::Model)), frame);
  Json result;
  if (run.control) {
    result = control_to_json(*run.control);
  } else if (const auto scale = scale_by(run.distances, run.markers, model)) {
    result = distances_to_json(*scale);
  }
  widen_by_focal(frame, run.focal_sigma);
  if (result.is_object()) result["metres_sigma"] = frame.metres_sigma;
  const bool is_new = frame.metres_per_unit != before.metres_per_unit ||
                      frame.metres_sigma != before.metres_sigma ||
                      frame.scale_source != before.scale_source || frame.up != before.up;
  if (is_new && !restate_frame(run.request.output / "model", model)) {
    run.warnings.push_back(
        printable(run.request.output / "model/gaussians.ply") +
        " was changed by another program; with the scale it was written anew, as "
        "it was read");
  }
  use_metres_where_measured(model.scene);
  run.model = std::move(model);
  return {result};
}

StageResult run_views(Run& run, const Progress& progress) {
  Model& model = loaded_model(run);
  return {views_to_json(write_views(
      model, views_with_photograph(model.scene), run.request.output / "views", progress))};
}

StageResult run_evaluation(Run& run, const Progress& progress) {
  const Model& model = loaded_model(run);
  if (model.scene.held_out.empty()) return {};
  return {evaluation_to_json(evaluate_views(model, model.scene.held_out, progress))};
}

StageResult run_splats(Run& run, const Progress& progress) {
  const WebSplats made = write_web_splats(run.request.output / "web",
                                          loaded_model(run),
                                          {run.request.fill, run.request.local_origin},
                                          progress);
  StageResult out{
      web_splats_to_json(made),
      "kept " + std::to_string(made.thinned.splats.size()) + " of " + std::to_string(made.of)};
  if (made.fill) out.remark += ", with " + std::to_string(made.fill->splats.size()) + " synthetic";
  return out;
}

StageResult run_mesh(Run& run, const Progress& progress) {
  const MeshesReport made = write_meshes(loaded_model(run), run.request, progress);
  StageResult out{meshes_to_json(made, run.model->scene.frame)};
  for (const auto& [name, why] : made.files.left_out) out.left_out.push_back("mesh/" + name);
  return out;
}

StageResult run_web(Run& run, const Progress& progress) {
  const Model& model = loaded_model(run);
  const Frame& frame = model.scene.frame;
  const AssetsReport made =
      write_assets(model,
                   loaded_mesh(run),
                   run.request,
                   result_of(run, Stage::Model).at("description").get<std::string>(),
                   mesh_findings(result_of(run, Stage::Mesh), frame),
                   progress);
  return {assets_to_json(made, frame)};
}

Json report_json(const Run& run) {
  const Scene& scene = run.model->scene;
  Json photographs = Json::object();
  for (const View& view : scene.views) photographs[view.name] = view.image_path.string();
  Json stages = Json::array();
  for (const auto& [name, stage] : run.record.json()["stages"].items()) {
    stages.push_back(
        {{"stage", name}, {"seconds", stage["seconds"]}, {"peak_memory", stage["peak_memory"]}});
  }
  const Json mesh = result_of(run, Stage::Mesh);
  Json warnings = run.scene.warnings;
  for (const Stage stage : {Stage::Model, Stage::Scale}) {
    const Json result = result_of(run, stage);
    if (!result.is_object()) continue;
    const Json found = result.value("warnings", Json::array());
    warnings.insert(warnings.end(), found.begin(), found.end());
  }
  std::vector<std::string> notes = run.scene.notes;
  Json model = result_of(run, Stage::Model);
  // Of the model stage it is in the unit of the cameras; the scale may have been told since.
  if (scene.water) model["water"].update(water_json(*scene.water, scene.frame));
  for (std::string& remark : remarks_on_photographs(model)) notes.push_back(std::move(remark));
  Json out = {{"program", program_version()},
              {"scene", scene_kind_name(run.scene.kind)},
              {"folder", run.request.scene.path.string()},
              {"units", scene.frame.unit_name()},
              {"scale_source", scale_source_name(scene.frame.scale_source)},
              {"frame", frame_to_json(scene.frame)},
              {"scale", result_of(run, Stage::Scale)},
              {"model", model},
              {"views", result_of(run, Stage::Views)},
              {"evaluation", result_of(run, Stage::Evaluation)},
              {"mesh", mesh},
              {"certificate", mesh.at("certificate")},
              {"web", result_of(run, Stage::Web)},
              {"splats", result_of(run, Stage::Splats)},
              {"photographs", photographs},
              {"stages", stages},
              {"warnings", warnings},
              {"notes", notes}};
  if (!run.refined.is_null()) out["refined_poses"] = run.refined;
  if (!run.request.settings_reason.empty()) out["settings_reason"] = run.request.settings_reason;
  return out;
}

// What fills the holes of the splats for browsers.
Gaussians web_fill(const Run& run) {
  if (!result_of(run, Stage::Splats).contains("fill")) return {};
  try {
    return read_web_fill(run.request.output / "web", run.model->scene.frame);
  } catch (const BadInput&) {
    return {};  // somebody changed the file, which was said
  }
}

StageResult run_report(Run& run, const Progress& progress) {
  loaded_model(run);
  report(progress, 0);
  const Json json = report_json(run);
  write_file(run.request.output / "report.json", json_text(versioned(json)) + "\n");
  const std::string viewer =
      viewer_section(loaded_model(run), loaded_mesh(run), web_fill(run), progress);
  write_html_report(run.request.output, json, run.model->scene, viewer);
  return {Json{{"pages", 1}}};
}

StageResult do_work(Stage stage, Run& run, const Progress& progress) {
  switch (stage) {
    case Stage::Model:
      return run_model(run, progress);
    case Stage::Scale:
      return run_scale(run, progress);
    case Stage::Views:
      return run_views(run, progress);
    case Stage::Evaluation:
      return run_evaluation(run, progress);
    case Stage::Splats:
      return run_splats(run, progress);
    case Stage::Mesh:
      return run_mesh(run, progress);
    case Stage::Web:
      return run_web(run, progress);
    case Stage::Report:
      break;
  }
  return run_report(run, progress);
}

// What somebody changed of the files of a finished stage may be wanted, and stays.
void warn_of_changed_files(const StageFiles& stage, const Run& run, const Terminal& terminal) {
  std::set<std::string> unsettled;  // a later stage may have been stopped after it wrote them
  for (const StageFiles& other : run.stages) {
    if (!is_done(run, other)) unsettled.merge(other.all());
  }
  for (const std::string& file : run.record.changed_files(traits(stage.stage).name)) {
    if (unsettled.contains(file)) continue;
    terminal.warn({printable(run.request.output / file) +
                   " is not what the run wrote and stays as it is; remove it to have it made "
                   "again"});
  }
}

// Hashes of what the stages wrote when they did: verify_run() holds the disk against them.
void note_outputs(Run& run, bool is_fresh) {
  if (!is_fresh && run.record.json().contains("outputs")) return;
  Json outputs = output_hashes(run.request.output, camera_files());
  outputs.update(run.record.file_hashes());
  run.record.note("outputs", outputs);
}

void warn_of(const Json& result, const Terminal& terminal) {
  if (!result.is_object() || !result.contains("warnings")) return;
  terminal.warn(result["warnings"].get<std::vector<std::string>>());
}

void do_stage(const StageFiles& stage, Run& run, Terminal& terminal) {
  const std::filesystem::path& output = run.request.output;
  const Json before = earlier_outputs(stage, run.stages, run.record, output);
  const CostMeter meter;  // from here on the peak of memory is that of the stage
  const StageResult result = do_work(stage.stage, run, terminal.begin(traits(stage.stage).title));
  const double seconds = terminal.end(result.remark);
  const std::vector<std::string> written = named_outputs(output, stage.all());
  std::set<std::string> outputs(written.begin(), written.end());
  for (const std::string& file : result.left_out) outputs.erase(file);
  const Json after = earlier_outputs(stage, run.stages, run.record, output);
  for (const auto& [name, hash] : after.items()) {
    if (before.value(name, Json()) == hash) outputs.erase(name);
  }
  run.record.finish(traits(stage.stage).name, seconds, result.report, outputs);
  warn_of(result.report, terminal);
  terminal.warn(std::exchange(run.warnings, {}));
}

FinishedRun run_stages(Run& run, Terminal& terminal) {
  bool stale = false;  // a stage that ran makes everything after it stale
  const std::filesystem::path& output = run.request.output;
  for (const StageFiles& stage : run.stages) {
    if (!stale && is_done(run, stage)) {
      terminal.say(std::string(traits(stage.stage).title) + ": done before");
      warn_of(result_of(run, stage.stage), terminal);
      warn_of_changed_files(stage, run, terminal);
      continue;
    }
    if (!stale) remove_outputs_after(stage.stage, run.stages, run.record, output);
    stale = true;
    do_stage(stage, run, terminal);
  }
  forget_checkpoints(output / "model");
  for (const RequestField& field : noted_fields()) {
    const Json value = field.write(run.request, run.scene);
    if (!value.is_null()) run.record.note(field.key, value);
  }
  note_outputs(run, stale);
  loaded_model(run);
  FinishedRun out{report_json(run), {}};
  for (const StageFiles& stage : run.stages) {
    out.seconds.emplace_back(stage.stage, run.record.seconds(traits(stage.stage).name));
  }
  return out;
}

void remove_all_abandoned_files(const std::filesystem::path& output) {
  for (const char* folder : {"",
                             "model",
                             "model/colmap",
                             "model/colmap/sparse/0",
                             "model/priors",
                             "views",
                             "mesh",
                             "web",
                             "web/surroundings"}) {
    remove_abandoned_files(output / folder);
  }
}

}  // namespace

FinishedRun run_pipeline(const RunRequest& request,
                         Terminal& terminal,
                         const FirstLook& first_look) {
  refuse_contradictions(request);
  if (!request.overwrite) refuse_foreign_files(request.output, stage_files({}, request.lods));
  OpenedScene opened = open_scene_of(request, terminal);
  Scene& scene = opened.scene;
  terminal.note(scene.notes);
  terminal.warn(scene.warnings);
  const PictureWork work = picture_work(request);
  const std::vector<StageMemory> plan = memory_plan(scene, work);
  terminal.say("memory: " + memory_plan_text(plan));
  const size_t budget = memory_budget(request.memory_limit);
  check_memory_plan(scene, work, budget);
  scene.cache = std::make_shared<PhotographCache>(spare_memory(plan, budget));
  refuse_unreadable(scene, most_memory(plan), terminal.begin("reading photographs"));
  (void)terminal.end("");
  const size_t known = scene.warnings.size();
  const Json fit = camera_fit_to_json(check_stated_cameras(opened, terminal));
  terminal.warn(std::vector(scene.warnings.begin() + std::ptrdiff_t(known), scene.warnings.end()));
  std::vector<KnownDistance> distances = known_distances(request.scene.known_distances, scene);
  std::vector<MarkerBar> markers = marker_bars(scene, request.scene.marker_size);
  check_lengths(request, scene);
  make_output_folder(request.output);
  const FolderLock lock(request.output);
  std::vector<StageFiles> stages = stage_files(scene, request.lods);
  if (!request.overwrite) refuse_foreign_files(request.output, stages);
  const std::string little_room = little_room_warning(scene, request.output);
  if (!little_room.empty()) terminal.warn(little_room);
  RunRecord record(request.output,
                   request_json(request, scene),
                   request.overwrite,
                   decided_stages(request, scene));
  remove_all_abandoned_files(request.output);
  opened.keep(request.output / "model");
  record.note("predicted_memory", memory_to_json(plan));
  record.note("camera_fit", fit);
  const Json refined = opened.refined ? refinement_to_json(opened.refined->report) : Json();
  record.note("refined_poses", refined);
  const StageFiles& first = stages.front();
  if (first_look && !record.is_done(traits(first.stage).name, first.files)) first_look(opened);
  Run run{request,
          std::move(stages),
          std::move(record),
          std::move(scene),
          std::move(distances),
          std::move(markers),
          std::move(opened.control),
          refined,
          opened.focal_sigma(),
          {},
          {},
          {},
          terminal};
  try {
    return run_stages(run, terminal);
  } catch (const Json::exception&) {
    throw BadInput(Defect::Schema,
                   request.output / "run.json",
                   "does not hold what finished stages wrote; remove it and say --overwrite to "
                   "begin anew");
  }
}

}  // namespace cgs
