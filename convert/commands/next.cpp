// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/model/camera_path_file.h"
#include "convert/model/model.h"
#include "convert/model/views.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"
#include "libcgs/reconstruct/next_view.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

struct NextArgs {
  std::filesystem::path model;
  std::filesystem::path output;
  std::filesystem::path cameras;
  std::string views;
  size_t count = 5;
  CommonOptions common;
};

// "from view_02: 30° to the right, 20° higher"
std::string place_words(const NextView& view, const Model& model) {
  const auto degrees = [](double radians) {
    return static_cast<int>(std::lround(std::abs(radians) * 180 / std::numbers::pi));
  };
  std::string out;
  const auto add = [&](const std::string& words) { out += (out.empty() ? "" : ", ") + words; };
  if (degrees(view.right) > 0) {
    add(std::to_string(degrees(view.right)) + "° to the " + (view.right > 0 ? "right" : "left"));
  }
  if (degrees(view.higher) > 0) {
    add(std::to_string(degrees(view.higher)) + (view.higher > 0 ? "° higher" : "° lower"));
  }
  constexpr double kNoticeable = 0.1;
  if (std::abs(view.farther - 1) > kNoticeable) {
    char times[48];
    std::snprintf(times, sizeof times, "%.1f times as far away", view.farther);
    add(times);
  }
  const int nearest = model.scene.input[view.nearest];
  const std::string name = printable(model.scene.views[static_cast<size_t>(nearest)].name);
  return out.empty() ? "beside " + name : "from " + name + ": " + out;
}

Json to_json(const std::vector<NextView>& views, const Model& model) {
  Json out = Json::array();
  for (const NextView& view : views) {
    const int nearest = model.scene.input[view.nearest];
    out.push_back({{"name", view.name.empty() ? Json() : Json(view.name)},
                   {"place", place_words(view, model)},
                   {"nearest_view", model.scene.views[static_cast<size_t>(nearest)].name},
                   {"worth", view.worth},
                   {"open", view.open},
                   {"unsure", view.unsure},
                   {"shared", view.shared}});
  }
  return out;
}

void print_table(const std::vector<NextView>& views, const Model& model) {
  std::printf("%4s %8s %8s %8s  %s\n", "", "open", "unsure", "known", "where to stand");
  for (size_t i = 0; i < views.size(); ++i) {
    const NextView& view = views[i];
    const std::string name = view.name.empty() ? "" : printable(view.name) + ", ";
    std::printf("%4zu %8s %8s %8s  %s\n",
                i + 1,
                percent(view.open).c_str(),
                percent(view.unsure).c_str(),
                percent(view.shared).c_str(),
                (name + place_words(view, model)).c_str());
  }
}

// The cameras that are asked for, or those around the input views.
std::vector<NextView> candidates(const NextArgs& args, const Model& model) {
  std::vector<NextView> out;
  if (!args.cameras.empty()) {
    for (const Camera& camera : camera_path_from(args.cameras, model)) {
      out.emplace_back().camera = camera;
    }
    return out;
  }
  if (args.views.empty()) return places_around(model);
  for (const int i : select_views(model.scene, args.views)) {
    const View& view = model.scene.views[static_cast<size_t>(i)];
    out.emplace_back().camera = view.camera;
    out.back().name = view.name;
  }
  return out;
}

void run_next(const NextArgs& args) {
  limit_threads(args.common.threads);
  Terminal terminal(args.common.quiet, args.common.strict);
  if (!args.output.empty()) {
    keep_apart(args.output, args.model);
    refuse_to_replace_path(args.output, args.cameras);
  }
  const Model model = read_model(args.model);
  std::vector<NextView> ranked =
      rank_next_views(model, candidates(args, model), terminal.begin("looking around"));
  const bool is_free = args.views.empty() && args.cameras.empty();
  if (is_free) ranked = apart(model, ranked, args.count);
  ranked.resize(std::min(ranked.size(), args.count));
  terminal.end(std::to_string(ranked.size()) + " places");
  if (!args.output.empty()) {
    std::vector<Camera> cameras;
    for (const NextView& view : ranked) cameras.push_back(view.camera);
    write_path(model, cameras, args.output, terminal.begin("pictures"), {HoleFill::None});
    terminal.end("holes in magenta: " + (args.output / "contact.png").string());
  }
  if (args.common.json) {
    print_report(to_json(ranked, model));
    return;
  }
  print_table(ranked, model);
}

}  // namespace

void add_next(CLI::App& app) {
  auto args = std::make_shared<NextArgs>();
  auto* cmd = app.add_subcommand("next", "Where to take the next photograph from");
  cmd->add_option("model", args->model, "Model folder, e.g. out/portal/model")->required();
  cmd->add_option("-o,--output",
                  args->output,
                  "Folder for pictures of what each place would show, holes in magenta");
  auto* views =
      cmd->add_option("--views",
                      args->views,
                      "Rank these photographs, which were not used: names, or indices in name "
                      "order from 0; default: places around the input views");
  cmd->add_option("--cameras", args->cameras, "Rank the cameras of a .json as cameras.json")
      ->excludes(views);
  cmd->add_option("--count", args->count, "Places to name at most; default 5")
      ->check(CLI::Range(size_t{1}, size_t{100}).description("1 to 100"));
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs next out/portal/model -o out/next\n"
      "         cgs next out/portal/model --views view_04,view_05,view_08\n"
      "open: no photograph shows it; unsure: shown, but nothing measured its depth; known: "
      "measured, which ties the new photograph to the others (40 % and more are good).");
  cmd->callback([args] { run_next(*args); });
}

}  // namespace cgs
