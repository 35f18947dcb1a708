// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/monitor/monitor_page.h"
#include "convert/monitor/two_dates.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

struct MonitorArgs {
  std::filesystem::path earlier;
  std::filesystem::path later;
  std::filesystem::path output;
  bool is_registered = false;
  std::string unit;
  CommonOptions common;
};

void print_side(const char* name, const Json& side, const std::string& unit) {
  std::printf("%s: %zu pieces, %s %s^2, volume %s +- %s %s^3; told from %s %s on, at %s of it\n",
              name,
              side["patches"].size(),
              number(side["area"], "%.3g").c_str(),
              unit.c_str(),
              number(side["volume"], "%.3g").c_str(),
              number(side["volume_sigma"], "%.2g").c_str(),
              unit.c_str(),
              number(side["detection"], "%.2g").c_str(),
              unit.c_str(),
              percent(side["comparable"]).c_str());
}

void run_monitor(const MonitorArgs& args) {
  limit_threads(args.common.threads);
  Terminal terminal(args.common.quiet, args.common.strict);
  keep_apart(args.output, args.earlier);
  keep_apart(args.output, args.later);
  if (!args.unit.empty()) (void)metres_in(args.unit, "--unit");
  const NewFolder folder(args.output);  // before minutes are spent
  TwoDates dates = read_two_dates(args.earlier, args.later, args.is_registered, terminal);
  if (!args.unit.empty() && !dates.earlier_surface.frame.has_metric_scale()) {
    throw InvalidInput("--unit " + args.unit +
                       ": neither date knows its scale; run one of them again with --marker-size "
                       "or --known-distance");
  }
  const FigureUnit unit = figure_unit(dates.earlier_surface.frame, args.unit);
  const DateChanges changes = changes_between(dates, terminal.begin("comparing"));
  terminal.end(std::to_string(changes.gained.patches.size()) + " pieces gained, " +
               std::to_string(changes.lost.patches.size()) + " lost");
  const auto pictures = date_pictures(dates, changes, terminal.begin("pictures"));
  terminal.end((args.output / "index.html").string());
  Json report = {{"earlier", args.earlier.string()}, {"later", args.later.string()}};
  report.update(monitor_json(dates, changes, unit));
  write_m3c2_ply(args.output / "later.ply", dates.later_surface, changes.gained.found);
  write_m3c2_ply(args.output / "earlier.ply", dates.earlier_surface, changes.lost.found);
  write_file(args.output / "changes.json", json_text(versioned(report)) + "\n");
  write_monitor_page(args.output / "index.html", report, dates.earlier_surface, pictures);
  if (args.common.json) {
    print_report(report);
    return;
  }
  print_side("gained", report["gained"], unit.name);
  print_side("lost", report["lost"], unit.name);
}

}  // namespace

void add_monitor(CLI::App& app) {
  auto args = std::make_shared<MonitorArgs>();
  auto* cmd = app.add_subcommand(
      "monitor", "What a place gained and lost between two dates, from photographs of both");
  cmd->add_option("earlier", args->earlier, "Folder of cgs run, of the earlier date")->required();
  cmd->add_option("later", args->later, "Folder of cgs run, of the later date")->required();
  cmd->add_option("-o,--output", args->output, "Folder to write: index.html shows both dates")
      ->required();
  cmd->add_flag("--registered",
                args->is_registered,
                "Both are in one frame already, by surveyed points or given cameras: move nothing");
  cmd->add_option("--unit", args->unit, "Unit of the figures; default m");
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Each date is reconstructed before, from its own photographs, as by\n"
      "cgs run photos/reef2026 --marker-size 80mm -o out/reef2026.\n"
      "One is laid onto the other by what photographs of both show, then by the surfaces, so that\n"
      "what did not change agrees.\n"
      "Volumes are known where the scale of one date is: a tape or a marker in its photographs.\n"
      "Example: cgs monitor out/reef2024 out/reef2026 --unit mm -o out/reef\n"
      "         xdg-open out/reef/index.html");
  cmd->callback([args] { run_monitor(*args); });
}

}  // namespace cgs
