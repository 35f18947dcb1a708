// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/model/hole_pictures.h"
#include "convert/model/model.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

struct FillArgs {
  std::filesystem::path model;
  std::optional<std::filesystem::path> painted;
  std::filesystem::path output;
  bool overwrite = false;
  CommonOptions common;
};

Json to_json(const PaintedPictures& painted, const PaintedFill& fill, const Model& model) {
  Json views = Json::array();
  for (size_t k = 0; k < fill.views.size(); ++k) {
    const ViewFill& view = fill.views[k];
    const SyntheticSource& source = painted.views[k].source;
    views.push_back({{"name", painted.names[k]},
                     {"file", source.file},
                     {"sha256", source.sha256},
                     {"hole_pixels", view.holes},
                     {"filled_before", view.filled_before},
                     {"left_open", view.left_open},
                     {"lifted", view.lifted},
                     {"moved_back", view.moved_back},
                     {"unplaced", view.unplaced},
                     {"shone_through", view.shone_through}});
  }
  const double made_up = double(fill.gaussians.size());
  return {{"splats", fill.gaussians.size()},
          {"synthetic_fraction", made_up / (made_up + double(model.gaussians.size()))},
          {"views", views},
          {"unpainted", painted.unpainted}};
}

std::string count_of(const PaintedFill& fill) {
  const std::string out = std::to_string(fill.gaussians.size()) + " synthetic Gaussians";
  const double open = open_share(fill);
  return open > 0 ? out + "; " + percent(open) + " of the holes stay open" : out;
}

PaintedHoles from_painter(const Model& model, const FillArgs& args, Terminal& terminal) {
  PaintedHoles out;
  out.painted = read_painted_pictures(model, *args.painted, terminal.begin("compare"));
  terminal.end(std::to_string(out.painted.views.size()) + " painted pictures");
  for (const std::string& name : out.painted.unpainted) {
    terminal.note({name + " is not painted and left out"});
  }
  out.fill = lift_painted(model, out.painted.views, terminal.begin("lift"));
  if (out.fill.gaussians.size() == 0) {
    throw NumericalError("nothing that was painted is hidden from all input views");
  }
  terminal.end(count_of(out.fill));
  return out;
}

PaintedHoles from_surroundings(const Model& model, Terminal& terminal) {
  PaintedHoles out = paint_surroundings(model, terminal.begin("paint"));
  terminal.end(count_of(out.fill));
  return out;
}

void run_fill(const FillArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.output, args.model);
  if (args.painted) keep_apart(args.output, *args.painted);
  refuse_to_replace_model(args.output, args.overwrite);
  Terminal terminal(args.common.quiet, args.common.strict);
  const Model model = read_model(args.model);
  terminal.warn(model.scene.warnings);
  const PaintedHoles made =
      args.painted ? from_painter(model, args, terminal) : from_surroundings(model, terminal);
  write_filled_model(args.model, model, made.fill.gaussians, made.pictures, args.output);
  const Json report = to_json(made.painted, made.fill, model);
  terminal.say("synthetic: " + percent(report["synthetic_fraction"].get<double>()) +
               " of all Gaussians; pictures show them, and nothing measures them");
  if (args.common.json) print_report(report);
}

}  // namespace

void add_fill(CLI::App& app) {
  auto args = std::make_shared<FillArgs>();
  auto* cmd = app.add_subcommand(
      "fill", "Holes of pictures filled, as splats beside a model: from around, or as you painted");
  cmd->add_option("model", args->model, "Model folder, e.g. out/portal/model")->required();
  cmd->add_option("painted",
                  args->painted,
                  "Folder of cgs render --holes whose pictures were painted in the white of their "
                  "masks, and nowhere else; default: pieces of what is around the holes are "
                  "painted in them, where they do not open in the sky");
  cmd->add_option("-o,--output", args->output, "Model folder to write: the model with fill.ply")
      ->required();
  cmd->add_flag("-w,--overwrite", args->overwrite, "Replace a finished model");
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs fill out/portal/model -o out/filled\n"
      "         cgs fill out/portal/model out/holes -o out/filled\n"
      "         cgs render out/filled --path spiral -o out/spiral\n"
      "         cgs convert out/filled filled.glb --as splats\n"
      "Pictures to paint are those of cgs render out/portal/model --holes -o out/holes; paint in\n"
      "out/holes/hole_1.png and so on. Those that the program painted are in\n"
      "out/filled/surroundings.\n"
      "The evidence keeps its bits. fill.ply is tagged synthetic, with the SHA-256 of each\n"
      "picture; pictures and splat files show it, and no mesh, mask or figure takes it.");
  cmd->callback([args] { run_fill(*args); });
}

}  // namespace cgs
