// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/commands/info_file.h"
#include "convert/commands/info_photographs.h"
#include "convert/model/model.h"
#include "convert/model/views.h"
#include "convert/scene/baselines.h"
#include "convert/scene/scene_request.h"
#include "convert/text/advice.h"
#include "convert/text/frame_json.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

struct InfoArgs {
  SceneRequest scene;
  bool json = false;
  bool strict = false;
};

Json camera_json(const Scene& scene, int index) {
  const View& view = scene.views[static_cast<size_t>(index)];
  const Camera& camera = view.camera;
  const std::string role = view_role(scene, index);
  const DepthRange range = role == "input" ? depth_range(scene, index) : DepthRange{};
  return {{"index", index_of(scene, index)},
          {"name", view.name},
          {"role", role == "not used" && view.image_path.empty() ? "no image" : role},
          {"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"center", vector_to_json(camera.center())},
          {"near", range.near},
          {"far", range.far}};
}

Json baselines_json(const Scene& scene) {
  Json rows = Json::array();
  for (const Baseline& pair : baselines(scene)) {
    const Overlap both = overlap(scene, pair.a, pair.b);
    rows.push_back({{"views",
                     {scene.views[static_cast<size_t>(pair.a)].name,
                      scene.views[static_cast<size_t>(pair.b)].name}},
                    {"length", pair.length},
                    {"baseline_to_depth", pair.to_depth},
                    {"angle_degrees", pair.angle * 180 / std::numbers::pi},
                    {"shared_points", both.points},
                    {"overlap", both.share}});
  }
  return rows;
}

// Null where no input view has any.
Json depth_json(const Scene& scene) {
  size_t count = 0;
  std::filesystem::path first;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.depth_path.empty()) continue;
    if (count++ == 0) first = view.depth_path;
  }
  if (count == 0) return nullptr;
  std::string kind = "auto";
  for (const auto& [name, value] : depth_kinds()) {
    if (value == scene.depth_kind) kind = name;
  }
  return {{"input_views", count},
          {"first_file", first.string()},
          {"kind", kind},
          {"scale", scene.depth_scale}};
}

Json scene_json(const OpenedScene& opened,
                const Json& fit,
                const Json& photographs,
                const Json& coarse) {
  const Scene& scene = opened.scene;
  Json cameras = Json::array();
  for (int i = 0; i < static_cast<int>(scene.views.size()); ++i) {
    cameras.push_back(camera_json(scene, i));
  }
  Eigen::AlignedBox3d box;
  for (const View& view : scene.views) box.extend(view.camera.center());
  return {{"kind", scene_kind_name(scene.kind)},
          {"counts",
           {{"views", scene.views.size()},
            {"input", scene.input.size()},
            {"held_out", scene.held_out.size()},
            {"missing_images", scene.missing.size()},
            {"sparse_points", scene.points.size()}}},
          {"bounds",
           {{"camera_min", vector_to_json(box.min())}, {"camera_max", vector_to_json(box.max())}}},
          {"units", scene.frame.unit_name()},
          {"cameras", cameras},
          {"baselines", baselines_json(scene)},
          {"depth_files", depth_json(scene)},
          {"photographs", photographs},
          {"coarse_depth", coarse},
          {"camera_fit", fit},
          {"refined_poses", opened.refined ? refinement_to_json(opened.refined->report) : Json()},
          {"missing", scene.missing},
          {"warnings", scene.warnings},
          {"notes", scene.notes}};
}

void print_fit(const Json& info) {
  const Json& fit = info["camera_fit"];
  if (!fit.is_null()) {
    std::printf("cameras of input views fit the photographs to %.2f pixels (%zu matches)\n",
                fit["error"].get<double>(),
                fit["matches"].get<size_t>());
  }
  const Json& refined = info["refined_poses"];
  if (refined.is_null()) return;
  std::printf("refined: %s\n", refinement_words(refinement_from_json(refined)).c_str());
  for (const Json& view : refined["views"]) {
    std::printf(
        "  %-24s %-9s %6d matches, %6d points, moved %.3f degrees, %.4g units, error %s -> %s "
        "pixels\n",
        one_line(view["view"].get<std::string>()).c_str(),
        view["role"].get<std::string>().c_str(),
        view["matches"].get<int>(),
        view["points"].get<int>(),
        view["degrees"].get<double>(),
        view["distance"].get<double>(),
        number(view["error_before"], "%.2f").c_str(),
        number(view["error_after"], "%.2f").c_str());
  }
}

// Of many views the table would be long: of each the two others that stand nearest.
std::vector<Json> told_baselines(const Json& all) {
  constexpr size_t kFew = 15;  // of six views
  constexpr int kOfEach = 2;
  std::vector<Json> rows(all.begin(), all.end());
  if (rows.size() <= kFew) return rows;
  std::stable_sort(rows.begin(), rows.end(), [](const Json& a, const Json& b) {
    return a["length"].get<double>() < b["length"].get<double>();
  });
  std::map<std::string, int> told;
  std::erase_if(rows, [&](const Json& row) {
    int& first = told[row["views"][0].get<std::string>()];
    int& second = told[row["views"][1].get<std::string>()];
    if (first >= kOfEach && second >= kOfEach) return true;
    ++first;
    ++second;
    return false;
  });
  std::stable_sort(rows.begin(), rows.end(), [](const Json& a, const Json& b) {
    return a["views"] < b["views"];
  });
  return rows;
}

void print_baselines(const Json& all) {
  const std::vector<Json> rows = told_baselines(all);
  std::printf("\nbaselines between input views%s:\n",
              rows.size() < all.size() ? ", of each to those that stand nearest" : "");
  for (const Json& row : rows) {
    std::printf("  %s - %s: %.4g units, %.1f %% of the depth, %.1f degrees",
                one_line(row["views"][0].get<std::string>()).c_str(),
                one_line(row["views"][1].get<std::string>()).c_str(),
                row["length"].get<double>(),
                100 * row["baseline_to_depth"].get<double>(),
                row["angle_degrees"].get<double>());
    const auto shared = row["shared_points"].get<size_t>();
    if (shared > 0) {
      std::printf("; %zu sparse points in both, on %.0f %% of the picture",
                  shared,
                  100 * row["overlap"].get<double>());
    }
    std::printf("\n");
  }
}

void print_scene(const Json& info) {
  const Json& counts = info["counts"];
  std::printf(
      "%s scene: %zu views (%zu input, %zu held out, %zu images missing), %zu sparse points\n",
      info["kind"].get<std::string>().c_str(),
      counts["views"].get<size_t>(),
      counts["input"].get<size_t>(),
      counts["held_out"].get<size_t>(),
      counts["missing_images"].get<size_t>(),
      counts["sparse_points"].get<size_t>());
  std::printf("units: %s\n\n%5s %-24s %-9s %11s %9s %22s\n",
              info["units"].get<std::string>().c_str(),
              "index",
              "name",
              "role",
              "size",
              "focal",
              "depth range");
  for (const Json& c : info["cameras"]) {
    const double near = c["near"].get<double>();
    std::printf("%5d %-24s %-9s %5d x %-5d %7.1f",
                c["index"].get<int>(),
                one_line(c["name"].get<std::string>()).c_str(),
                c["role"].get<std::string>().c_str(),
                c["width"].get<int>(),
                c["height"].get<int>(),
                c["fx"].get<double>());
    if (near > 0) std::printf("  %9.4g ... %-9.4g", near, c["far"].get<double>());
    std::printf("\n");
  }
  print_baselines(info["baselines"]);
  const Json& depth = info["depth_files"];
  if (!depth.is_null()) {
    const auto kind = depth["kind"].get<std::string>();
    std::printf("depth files: for %zu of %zu input views, %s …, %s\n",
                depth["input_views"].get<size_t>(),
                counts["input"].get<size_t>(),
                printable(std::filesystem::path(depth["first_file"].get<std::string>())).c_str(),
                kind == "auto" ? "of a kind that training finds out" : kind.c_str());
  }
  print_fit(info);
  print_photographs(info["photographs"], info["coarse_depth"]);
  for (const Json& name : info["missing"]) {
    std::printf("missing: %s\n", one_line(name.get<std::string>()).c_str());
  }
  for (const Json& text : info["notes"]) {
    std::printf("note: %s\n", one_line(text.get<std::string>()).c_str());
  }
  print_warnings(info);
}

// info tells what is wrong with a scene, photographs that cannot be read too, and nothing else.
// \param question  that stays open then
template <typename Look>
Json told_or_warned(Scene& scene, const std::string& question, const Look& look) {
  std::string reason;
  try {
    return look();
  } catch (const BadInput& error) {
    reason = words_of(error);
  } catch (const LimitError& error) {
    reason = words_of(error);
  }
  scene.warnings.push_back(question + " could not be told: " + reason);
  return nullptr;
}

// Options of scenes would change nothing of what is said of anything else.
void refuse_for_others(const CLI::App& command, const std::filesystem::path& path) {
  std::error_code none;
  const char* const kind = std::filesystem::is_regular_file(path, none) ? "a file"
                           : is_present(path / "run.json")              ? "a run"
                           : holds_model(path)                          ? "a model"
                                                                        : nullptr;
  if (kind == nullptr) return;
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_name(false, true);
    const bool is_for_all = option->get_positional() || name == "--json" || name == "--strict";
    if (option->count() == 0 || is_for_all) continue;
    throw InvalidInput(name + " is for folders of photographs; " + printable(path) + " is " + kind);
  }
}

Json tell_scene(const InfoArgs& args) {
  Terminal terminal(args.json);
  OpenedScene opened = open_scene(args.scene, {}, terminal);
  const Json fit = told_or_warned(opened.scene, "whether the cameras fit", [&] {
    Terminal quiet(true);
    return camera_fit_to_json(check_stated_cameras(opened, quiet));
  });
  Scene small;
  const Json photographs = told_or_warned(opened.scene, "how the photographs were taken", [&] {
    return photographs_to_json(opened.scene, small);
  });
  Json coarse;
  if (!photographs.is_null()) {
    coarse = told_or_warned(
        opened.scene, "what of them can be measured", [&] { return coarse_depth_to_json(small); });
  }
  Json info = scene_json(opened, fit, photographs, coarse);
  if (args.json) {
    print_report(info);
  } else {
    print_scene(info);
  }
  return info;
}

void run_info(const InfoArgs& args) {
  const std::optional<Json> file = print_file_info(args.scene.path, args.json);
  const Json info = file ? *file : tell_scene(args);
  if (args.strict && info.contains("warnings") && !info["warnings"].empty()) {
    throw BadInput(Defect::Value, args.scene.path, "--strict: a warning counts as an error");
  }
}

}  // namespace

void add_info(CLI::App& app) {
  auto args = std::make_shared<InfoArgs>();
  auto* cmd = app.add_subcommand(
      "info",
      "What a scene, a file or a finished run holds and what is wrong with it (exit code 3 if it "
      "cannot be used)");
  cmd->add_option(
         "scene",
         args->scene.path,
         "Folder of a scene, as for run, or what run made of one, or its model; a mesh (.ply, "
         ".obj, .stl, .off, .om, .3mf, .glb, .gltf), which gets a certificate; splats (.ply, .spz, "
         ".splat, .sog or its meta.json, .ksplat, .glb, .gltf); a volume (.vdb); layers of a "
         "picture (.exr)")
      ->required();
  add_scene_options(*cmd, args->scene.options);
  add_camera_options(*cmd, args->scene);
  cmd->add_flag("--json", args->json, "Print JSON on standard output");
  cmd->add_flag("--strict", args->strict, "A warning ends the command with exit code 3");
  cmd->footer(
      "Example: cgs info photos/portal --views 1,10,19\n"
      "         cgs info part.stl\n"
      "Of photographs, blur is the share of contrast that stays when one is blurred once more "
      "(0.2\n"
      "to 0.4: sharp), exposure is in stops beside their median, burnt and black are clipped;\n"
      "measured is what two or more small pictures agree on, moving what stood elsewhere in the\n"
      "others, which three can tell.");
  cmd->callback([args, cmd] {
    refuse_for_others(*cmd, args->scene.path);
    run_info(*args);
  });
}

}  // namespace cgs
