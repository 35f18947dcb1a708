// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/run_options.h"
#include "convert/files/mesh_files.h"
#include "convert/report/report_frame.h"
#include "convert/report/report_surface.h"
#include "convert/run/budget.h"
#include "convert/run/forecast.h"
#include "convert/run/pipeline.h"
#include "convert/run/preview.h"
#include "convert/text/frame_json.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct RunArgs : RunArguments {
  bool preview = false;
  bool no_preview = false;
  bool dry_run = false;
};

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
  keep_run_apart(args.request.output, args.request.scene.path);
  RunRequest request = run_request(args);
  Terminal terminal(args.common.quiet, args.common.strict);
  const auto start = std::chrono::steady_clock::now();
  const double budget = stated_budget(args);
  if (args.dry_run) {
    const nlohmann::ordered_json found = forecast(request, terminal);
    if (args.common.json) print_report(found);
    terminal.say(forecast_words(found));
    return;
  }
  if (args.preview) {
    const nlohmann::ordered_json report = write_preview(request, terminal);
    if (args.common.json) print_report(report);
    terminal.say("preview: " + preview_words(report));
    terminal.say("open " + (request.output / kPreviewFolder / "report.html").string());
    return;
  }
  FirstLook first_look;
  if (budget > 0) {
    request = within_budget(request, budget, start, terminal);
  } else if (!args.no_preview) {
    first_look = [&](const OpenedScene& opened) { look_first(request, opened, terminal); };
  }
  const nlohmann::ordered_json report = run_pipeline(request, terminal, first_look).report;
  if (args.common.json) print_report(report);
  say_summary(report, args, terminal);
  if (budget > 0) {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    terminal.say("took " + format_seconds(taken.count()) + " of " + format_seconds(budget));
  }
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
  add_overwrite_option(*cmd, args->request);
  add_run_options(*cmd, *args);
  cmd->add_flag("--preview",
                args->preview,
                "A first look, in seconds once the cameras are there: small pictures, no "
                "training, in OUT/preview; says how much is measured, and stops there")
      ->excludes("--downscale")
      ->excludes("--preset")
      ->excludes("--budget");
  cmd->add_flag(
         "--no-preview",
         args->no_preview,
         "No such look before a run that takes minutes; default: OUT/preview is written first")
      ->excludes("--preview");
  cmd->add_flag("--dry-run",
                args->dry_run,
                "Say which photographs would be used, and what memory and disk a run would take; "
                "with --json for schedulers. Nothing is made, but cameras that are solved for stay")
      ->excludes("--preview")
      ->excludes("--budget");
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
