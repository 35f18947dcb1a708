// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/files/mesh_files.h"
#include "convert/report/report_frame.h"
#include "convert/report/report_surface.h"
#include "convert/run/budget.h"
#include "convert/run/pipeline.h"
#include "convert/run/preview.h"
#include "convert/run/verification.h"
#include "convert/text/frame_json.h"
#include "convert/text/length.h"
#include "io/bytes/json_file.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct RunArgs {
  RunRequest request;
  TrainingArguments training;
  CommonOptions common;
  std::optional<EstimatedSurface> estimated;
  std::string max_size;
  std::string budget;
  bool preview = false;
};

size_t asked_size(const std::string& text) {
  constexpr size_t kLeast = 1000;  // of a file with nothing in it
  const size_t bytes = parse_file_size(text);
  if (bytes >= kLeast) return bytes;
  throw InvalidInput("--max-size " + text + " is " + std::to_string(bytes) +
                     " bytes, too few for any asset; write 800kB or 2MB");
}

// One paragraph a user reads after a run: what was made, how far to trust it, what to open.
void say_summary(const nlohmann::ordered_json& report, const RunArgs& args, Terminal& terminal) {
  const auto& scale = report["scale"];
  if (!scale.is_null()) {
    terminal.say("scale: " + scale_words(report));
    if (scale.contains("control_points")) terminal.say(control_words(scale));
  }
  const std::string origin = far_origin(report["frame"]);
  if (!origin.empty()) terminal.say(origin);
  const std::string place =
      glb_place_text("web/asset.glb", frame_from_json(report["frame"]), args.request.local_origin);
  if (!place.empty()) terminal.say(place);
  const auto& certificate = report["certificate"];
  terminal.say(std::string("watertight mesh: ") +
               (certificate["passed"].get<bool>() ? "closed, manifold, no self-intersection"
                                                  : "NOT certified, see the report") +
               ", " + std::to_string(certificate["faces"].get<size_t>()) + " faces");
  for (const auto& [file, reason] : report["mesh"]["output"]["left_out"].items()) {
    terminal.say(file + " left out: " + reason.get<std::string>());
  }
  for (const std::string& words : promise_words(report)) terminal.say(words);
  for (const std::string& words : level_words(report)) terminal.say(words);
  terminal.say("open " + (args.request.output / "report.html").string());
}

void run_run(const RunArgs& args) {
  limit_threads(args.common.threads);
  keep_scene_apart(args.request.output,
                   args.request.scene.path,
                   {"model", "views", "mesh", "web", kPreviewFolder, kRecomputedFolder});
  RunRequest request = args.request;
  request.training = training_options(args.training);
  request.memory_limit = stated_memory_limit(args.common);
  request.estimated = args.estimated.value_or(request.estimated);
  if (!args.max_size.empty()) request.max_size = asked_size(args.max_size);
  if (!request.scene.assume_unit.empty()) (void)metres_in(request.scene.assume_unit);
  Terminal terminal(args.common.quiet, args.common.strict);
  const auto start = std::chrono::steady_clock::now();
  const double budget = args.budget.empty() ? 0 : parse_seconds(args.budget);
  const std::vector<std::string>& set = args.training.settings;
  const bool sets_steps = std::any_of(
      set.begin(), set.end(), [](const std::string& s) { return s.rfind("steps=", 0) == 0; });
  if (budget > 0 && sets_steps) {
    throw InvalidInput("--budget chooses the steps of the training; give it or --set steps");
  }
  if (args.preview) {
    const nlohmann::ordered_json report = write_preview(request, terminal);
    if (args.common.json) std::cout << json_text(report) << "\n";
    terminal.say("preview: " + preview_words(report));
    terminal.say("open " + (request.output / kPreviewFolder / "report.html").string());
    return;
  }
  if (budget > 0) request = within_budget(request, budget, start, terminal);
  const nlohmann::ordered_json report = run_pipeline(request, terminal).report;
  if (args.common.json) std::cout << json_text(report) << "\n";
  say_summary(report, args, terminal);
  if (budget > 0) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    terminal.say("took " + format_seconds(taken.count()) + " of " + format_seconds(budget));
  }
}

void add_surface_options(CLI::App& command, RunArgs& args) {
  const OptionGroup group(command, "Surface and files");
  command.add_option("--voxel-size",
                     args.request.voxel_size,
                     "Edge of a voxel, e.g. 5mm, or in scene units; default: from the pixel size");
  command.add_option(
      "--simplify",
      args.request.simplify,
      "Largest error of simplified meshes where there is evidence, e.g. 2mm; four times "
      "that where inferred or estimated, as much again for asset.glb, whose photographs hold "
      "the colours; default: a quarter of a voxel; 0 = do not simplify");
  command.add_option("--compression-error",
                     args.request.compression_error,
                     "Largest error of the compressed mesh, e.g. 0.2mm; default: size / 16384");
  add_glb_option(command, args.request.glb_encoding);
  add_local_origin_option(
      command, args.request.local_origin, "What is in web/, but for splats.spz,");
  add_estimated_option(command, args.estimated);
  command
      .add_option(
          "--lods",
          args.request.lods,
          "Coarser levels of asset.glb to write, 0 to 5, with a tileset.json (3D Tiles) for "
          "viewers that show the one that the distance asks for; default 0")
      ->check(CLI::Range(size_t{0}, kMostLods).description("0 to " + std::to_string(kMostLods)));
}

void add_promises(CLI::App& command, RunArgs& args) {
  const OptionGroup group(command, "Promises, kept or refused");
  command.add_option("--max-error",
                     args.request.max_error,
                     "Every mesh written, asset.glb too but not its coarser levels, lies within "
                     "this of the fused surface, measured on the files, e.g. 1mm, or in scene "
                     "units; in place of --simplify and --compression-error");
  command.add_option("--max-size",
                     args.max_size,
                     "asset.glb with its textures is no larger, e.g. 2MB; leaves out the "
                     "least detail that is needed and says how much that is");
  command.add_option(
      "--budget",
      args.budget,
      "Time for all of it, e.g. 3min: tries small pictures, then takes the largest "
      "size and the training that this machine can do in it; in place of --downscale and "
      "--preset");
  command.add_flag("--preview",
                   args.preview,
                   "A first look, in seconds once the cameras are there: small pictures, no "
                   "training, in OUT/preview; says how much is measured, and stops there");
}

}  // namespace

void add_run(CLI::App& app) {
  auto args = std::make_shared<RunArgs>();
  auto* cmd = app.add_subcommand("run", "Photographs to every asset, resumable");
  cmd->add_option(
         "scene",
         args->request.scene.path,
         "Folder: LLFF, COLMAP, transforms.json (nerfstudio, instant-ngp), Strecha, Polycam, "
         "7-Scenes, Open3D, Metashape, RealityCapture, cameras.json (3DGS), or nothing but "
         "photographs")
      ->required();
  cmd->add_option("-o,--output", args->request.output, "Folder to write")->required();
  cmd->add_flag("-w,--overwrite", args->request.overwrite, "Replace the results of another run");
  add_scene_options(*cmd, args->request.scene.options);
  add_camera_options(*cmd, args->request.scene);
  add_scale_options(*cmd, args->request.scene);
  add_surface_options(*cmd, *args);
  add_promises(*cmd, *args);
  add_training_options(*cmd, args->training);
  for (const char* chosen : {"--downscale", "--preset"}) {
    cmd->get_option("--budget")->excludes(chosen);
    cmd->get_option("--preview")->excludes(chosen);
  }
  cmd->get_option("--preview")->excludes("--budget");
  add_common_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs run photos/portal --views 1,10,19 -o out/portal\n"
      "         cgs run photos/portal --preview -o out/portal\n"
      "         cgs run photos/portal --max-size 2MB -o out/portal_small\n"
      "         cgs run photos/portal --budget 3min -o out/portal_soon\n"
      "         cgs run photos/portal --assume-unit m --max-error 2mm -o out/portal_true\n"
      "         cgs run photos/portal --control-points survey.csv -o out/portal_utm\n"
      "Running it again resumes at the first stage whose output is not there.");
  cmd->callback([args] { run_run(*args); });
}

}  // namespace cgs
