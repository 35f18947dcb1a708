// SPDX-License-Identifier: GPL-3.0-or-later
#include <iostream>
#include <memory>
#include <numeric>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/model.h"
#include "convert/terminal.h"
#include "convert/views.h"
#include "io/json_file.h"
#include "io/scene_reader.h"

namespace cgs {

namespace {

struct RenderArgs {
  std::filesystem::path model;
  std::filesystem::path output;
  std::string views;
  CommonOptions common;
};

void run_render(const RenderArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.output, args.model);
  Terminal terminal(args.common.quiet);
  const Model model = read_model(args.model);
  terminal.warn(model.scene.warnings);
  std::vector<int> views(model.scene.views.size());
  std::iota(views.begin(), views.end(), 0);
  if (!args.views.empty()) views = select_views(model.scene, args.views);
  const nlohmann::ordered_json report =
      write_views(model, views, args.output, terminal.begin("render"));
  terminal.end(std::to_string(views.size()) + " views");
  if (args.common.json) std::cout << json_text(report) << "\n";
}

}  // namespace

void add_render(CLI::App& app) {
  auto args = std::make_shared<RenderArgs>();
  auto* cmd = app.add_subcommand(
      "render", "Model to EXR and PNG per camera: colour, depth, normal, support, holes");
  cmd->add_option("model", args->model, "Model folder, e.g. out/portal/model")->required();
  cmd->add_option("-o,--output", args->output, "Folder to write")->required();
  cmd->add_option("--views", args->views, "Cameras: indices in name order or names; default all");
  add_output_options(*cmd, args->common);
  cmd->footer("Example: cgs render out/portal/model --views 0,2 -o out/views");
  cmd->callback([args] { run_render(*args); });
}

}  // namespace cgs
