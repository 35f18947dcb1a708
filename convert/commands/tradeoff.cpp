// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/measure/measured_file.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "convert/tradeoff/tradeoff_report.h"
#include "io/bytes/atomic_file.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct TradeoffArgs {
  TradeoffRequest request;
  std::vector<std::string> wants;
  CommonOptions common;
};

// Before anything that takes time: what does not depend on the scene.
void refuse_early(const TradeoffArgs& args) {
  const TradeoffRequest& request = args.request;
  keep_apart(request.output, request.scene.path);
  require(request.minutes >= 0 && request.minutes <= 1e6,
          "--minutes must be in 0 ... 1000000",
          request.minutes);
  if (!request.scene.assume_unit.empty())
    (void)metres_in(request.scene.assume_unit, "--assume-unit");
  Frame of_known_scale;
  of_known_scale.metres_per_unit = 1;
  for (const std::string& want : args.wants) (void)parse_want(want, of_known_scale);
  if (!request.reference.empty()) {
    (void)read_measured(request.reference, request.scene.assume_unit);
  }
}

void run_tradeoff(const TradeoffArgs& args) {
  limit_threads(args.common.threads);
  refuse_early(args);
  TradeoffRequest request = args.request;
  request.memory_limit = stated_memory_limit(args.common);
  request.threads = args.common.threads;
  Terminal terminal(args.common.quiet, args.common.strict);
  const NewFolder folder(request.output);
  const CostMeter meter;
  // Keeps no cameras yet: another start would read them, and take that for the cost of solving.
  const OpenedScene opened = open_scene(request.scene, request.output, terminal);
  const StageCost opening = meter.read();
  terminal.note(opened.scene.notes);
  terminal.warn(opened.scene.warnings);
  TradeoffReport report;
  for (const std::string& want : args.wants) {
    report.wants.push_back(parse_want(want, opened.scene.frame));
  }
  report.tradeoff = measure_tradeoff(request, opened, opening, terminal);
  report.recommendation =
      recommend(figures_of(report.tradeoff), report.wants, report.tradeoff.noise);
  write_tradeoff(request.output, report);
  if (args.common.json) {
    print_report(tradeoff_json(report));
  } else {
    std::cout << tradeoff_text(report);
  }
  terminal.say("open " + (request.output / "tradeoff.html").string());
}

}  // namespace

void add_tradeoff(CLI::App& app) {
  auto args = std::make_shared<TradeoffArgs>();
  TradeoffRequest& request = args->request;
  auto* cmd = app.add_subcommand(
      "tradeoff", "Speed against accuracy on your scene: measures, and says what to use");
  cmd->add_option("scene", request.scene.path, "Folder of a scene, as for run")->required();
  cmd->add_option("-o,--output", request.output, "Folder to write")->required();
  add_scene_options(*cmd, request.scene.options);
  add_camera_options(*cmd, request.scene);
  cmd->add_option("--assume-unit",
                  request.scene.assume_unit,
                  "What one scene unit is (m, cm, mm, in, ft), where the scene does not say");
  cmd->add_option("--minutes", request.minutes, "Stop measuring then; start again to go on")
      ->capture_default_str();
  cmd->add_option("--reference",
                  request.reference,
                  "Mesh that counts as the truth, in the coordinates of the scene");
  cmd->add_option("--want",
                  args->wants,
                  "A need: error<2mm, time<3min, cpu<90s, size<1MB or psnr>24dB; may be repeated. "
                  "Says which setting meets all")
      ->allow_extra_args(false);
  cmd->add_flag("-w,--overwrite", request.overwrite, "Replace what was measured of another scene");
  add_common_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs tradeoff photos/statue --views 1,10,19 --assume-unit m -o out/tradeoff \\\n"
      "           --want \"error<5mm\" --want \"size<1MB\"\n"
      "Errors are distances that 95 % of what was photographed keep, from the finest setting or "
      "the\n"
      "reference. Times are those of the assets. Running it again goes on where it stopped.");
  cmd->callback([args] { run_tradeoff(*args); });
}

}  // namespace cgs
