// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/model/evaluation.h"
#include "convert/model/model.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct EvaluateArgs {
  std::filesystem::path model;
  std::filesystem::path scene;
  std::string views;
  bool allow_external = false;
  HoleFill fill = HoleFill::Around;
  CommonOptions common;
};

void print_table(const nlohmann::ordered_json& report) {
  std::printf("%-24s %-8s %8s %8s %10s %10s %8s %8s %6s\n",
              "view",
              "role",
              "PSNR",
              "SSIM",
              "PSNR seen",
              "SSIM seen",
              "holes",
              "MS-SSIM",
              "FLIP");
  const auto row =
      [](const std::string& name, const std::string& role, const nlohmann::ordered_json& r) {
        std::printf("%-24s %-8s %8s %8s %10s %10s %8s %8s %6s\n",
                    name.c_str(),
                    role.c_str(),
                    number(r["psnr"], "%.2f").c_str(),
                    number(r["ssim"], "%.3f").c_str(),
                    number(r["psnr_seen"], "%.2f").c_str(),
                    number(r["ssim_seen"], "%.3f").c_str(),
                    percent(r["hole_fraction"]).c_str(),
                    number(r["ms_ssim"], "%.3f").c_str(),
                    number(r["flip"], "%.3f").c_str());
      };
  for (const auto& view : report["views"]) {
    const auto& role = view["role"];
    row(view["name"].get<std::string>(), role.is_null() ? "-" : role.get<std::string>(), view);
  }
  row("mean", "", report["mean"]);
  const auto& eighth = report["every_eighth"];
  if (!eighth.is_null()) row("every eighth, as papers", "", eighth);
  if (report.contains("through_water")) {
    std::printf("pictures are rendered through the water that the photographs show\n");
  }
  const auto& views = report["views"];
  if (std::any_of(
          views.begin(), views.end(), [](const auto& v) { return !v["exposure"].is_null(); })) {
    std::printf("photographs are matched in exposure to the model, as its input views are\n");
  }
}

void run_evaluate(const EvaluateArgs& args) {
  limit_threads(args.common.threads);
  Terminal terminal(args.common.quiet, args.common.strict);
  Model model = read_model(args.model);
  if (!args.scene.empty()) relink_images(model.scene, args.scene, args.allow_external);
  terminal.warn(model.scene.warnings);
  const std::vector<int> views =
      args.views.empty() ? model.scene.held_out : select_views(model.scene, args.views);
  if (views.empty()) {
    throw InvalidInput("no view was held out; name the views to evaluate with --views");
  }
  for (const int i : views) {
    const View& view = model.scene.views[static_cast<size_t>(i)];
    if (args.views.empty() || !view.image_path.empty()) continue;
    throw InvalidInput("--views: the photograph of view " + printable(view.name) +
                       " is gone; --scene says where the photographs are");
  }
  const Evaluation evaluation = evaluate_views(model, views, terminal.begin("evaluate"), args.fill);
  terminal.end(std::to_string(evaluation.views.size()) + " views");
  terminal.warn(evaluation.warnings);
  const nlohmann::ordered_json report = evaluation_to_json(evaluation);
  if (args.common.json) {
    print_report(report);
  } else {
    print_table(report);
  }
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto args = std::make_shared<EvaluateArgs>();
  auto* cmd = app.add_subcommand(
      "evaluate", "PSNR, SSIM and FLIP on held-out views, over all pixels and without holes");
  cmd->add_option("model", args->model, "Model folder, e.g. out/portal/model")->required();
  cmd->add_option("--scene", args->scene, "Scene folder, where the photographs have moved");
  cmd->add_option(
      "--views", args->views, "Views: indices in name order or names; default held out");
  cmd->add_flag("--allow-external",
                args->allow_external,
                "Let --scene follow links and absolute paths out of its folder")
      ->needs("--scene");
  add_fill_option(*cmd, args->fill);
  add_output_options(*cmd, args->common);
  cmd->footer(
      "The mean leaves input views out where there are others: the model was trained on them.\n"
      "Example: cgs evaluate out/portal/model --scene photos/portal --json");
  cmd->callback([args] { run_evaluate(*args); });
}

}  // namespace cgs
