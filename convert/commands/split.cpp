// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/scene/scene_request.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/photographs.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/view_groups.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

struct SplitArgs {
  SceneRequest scene;
  std::filesystem::path output;
  size_t size = 40;
  CommonOptions common;
};

// With zeros before it, so that a shell lists groups in their order.
std::string group_name(size_t i, size_t count) {
  const std::string number = std::to_string(i + 1);
  return "group_" + std::string(std::to_string(count).size() - number.size(), '0') + number;
}

// Names as --views takes them.
std::vector<std::string> listable_names(const std::vector<int>& views, const Scene& scene) {
  std::vector<std::string> out = view_names(scene, views);
  for (const std::string& name : out) require_listable(name, "--views");
  return out;
}

// Before minutes are spent on cameras.
void refuse_unlistable(const SceneRequest& request) {
  if (!request.options.views.empty() || !is_photographs(request.path)) return;
  for (const PhotoFile& photograph :
       list_photographs({request.path, request.options.allow_external})) {
    require_listable(photograph.path.filename().string(), "--views");
  }
}

Json groups_json(const std::vector<ViewGroup>& groups, const SplitArgs& args, const Scene& scene) {
  Json out = {{"scene", args.scene.path.string()}, {"size", args.size}, {"groups", Json::array()}};
  for (size_t i = 0; i < groups.size(); ++i) {
    out["groups"].push_back({{"name", group_name(i, groups.size())},
                             {"views", listable_names(groups[i].all, scene)},
                             {"own", listable_names(groups[i].own, scene)}});
  }
  return out;
}

void refuse_to_replace(const std::filesystem::path& output) {
  if (!is_present(output / "groups.json")) return;
  throw InvalidInput(printable(output) + " holds the groups of a scene; choose another folder");
}

void write_groups(const Json& groups, const OpenedScene& opened, const SplitArgs& args) {
  for (const Json& group : groups["groups"]) {
    const std::filesystem::path folder = args.output / group["name"].get<std::string>();
    make_output_folder(folder / "model");
    opened.keep(folder / "model");
    write_file(folder / "views.txt", view_list(group["views"]) + "\n");
  }
  // Last: where it is, all is.
  write_file(args.output / "groups.json", json_text(versioned(groups)) + "\n");
}

void run_split(const SplitArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.output, args.scene.path);
  refuse_to_replace(args.output);
  Terminal terminal(args.common.quiet, args.common.strict);
  SceneRequest request = args.scene;
  if (request.options.views.empty()) request.options.all_views = true;
  const NewFolder folder(args.output);
  refuse_unlistable(request);
  const OpenedScene opened = open_scene(request, {}, terminal);
  terminal.warn(opened.scene.warnings);
  const Json groups = groups_json(group_views(opened.scene, args.size), args, opened.scene);
  make_output_folder(args.output);
  write_groups(groups, opened, args);
  if (args.common.json) print_report(groups);
  for (const Json& group : groups["groups"]) {
    terminal.say(group["name"].get<std::string>() + ": " + std::to_string(group["views"].size()) +
                 " photographs, " + std::to_string(group["own"].size()) + " of them its own");
  }
}

}  // namespace

void add_split(CLI::App& app) {
  auto args = std::make_shared<SplitArgs>();
  auto* cmd = app.add_subcommand(
      "split", "Many photographs to groups that overlap, each to be reconstructed by itself");
  cmd->add_option("scene", args->scene.path, "Folder of a scene, as for run")->required();
  cmd->add_option("-o,--output", args->output, "Folder to write: groups.json, and a folder each")
      ->required();
  cmd->add_option("--size", args->size, "Photographs of a group at most; default 40")
      ->check(CLI::Range(size_t{3}, size_t{1000}).description("3 to 1000"));
  cmd->add_option("--views",
                  args->scene.options.views,
                  "Cut these: names, or indices in name order from 0; default: all");
  add_depth_options(*cmd, args->scene.options);
  add_camera_options(*cmd, args->scene);
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs split photos/facade --size 40 -o out/facade\n"
      "         for g in out/facade/group_*; do\n"
      "           cgs train photos/facade --views \"$(cat $g/views.txt)\" -o $g/model\n"
      "         done\n"
      "         cgs fuse out/facade/group_*/model -o out/facade/all.vdb\n"
      "         cgs mesh out/facade/all.vdb -o out/facade/mesh\n"
      "Cameras of photographs alone are solved once, here; training a group takes them from its\n"
      "folder. Groups share photographs at their borders, which count once in the volume.");
  cmd->callback([args] { run_split(*args); });
}

}  // namespace cgs
