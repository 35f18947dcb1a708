// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/compare_splats.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/model.h"
#include "convert/splats/splat_comparison.h"
#include "convert/splats/splat_files.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "io/images/png.h"
#include "io/scenes/photographs.h"
#include "io/scenes/scene_reader.h"
#include "io/scenes/view_names.h"
#include "io/splats/splat_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

// In its canonical frame. Splats of a model are in the unit of its cameras, whatever it is.
Scene scene_in(const std::filesystem::path& folder) {
  if (holds_model(folder)) return std::move(read_model_as_written(folder).scene);
  Scene out = read_scene(folder);
  to_canonical(out);
  return out;
}

// At most so many, spread over them.
std::vector<int> spread(const std::vector<int>& views) {
  constexpr size_t kMost = 12;
  if (views.size() <= kMost) return views;
  std::vector<int> out;
  for (size_t k = 0; k < kMost; ++k) out.push_back(views[k * (views.size() - 1) / (kMost - 1)]);
  return out;
}

// Where only a scene is known, nobody knows which of its views the splats were made of.
std::vector<int> compared_views(const Scene& scene, const SplatCompareArgs& args) {
  if (!args.views.empty()) return select_views(scene, args.views);
  if (holds_model(args.scene) && !scene.held_out.empty()) return spread(scene.held_out);
  std::vector<int> all;
  for (int i = 0; i < static_cast<int>(scene.views.size()); ++i) all.push_back(i);
  return spread(all);
}

std::vector<ComparedView> views_of(const Scene& scene, const SplatCompareArgs& args) {
  std::vector<ComparedView> out;
  for (const int i : compared_views(scene, args)) {
    const View& view = scene.views[static_cast<size_t>(i)];
    out.push_back({view.name, view.camera, {}, {}});
  }
  return out;
}

void load_photograph(const Scene& scene, std::vector<std::string>& warnings, ComparedView& view) {
  const auto found = std::find_if(
      scene.views.begin(), scene.views.end(), [&](const View& v) { return v.name == view.name; });
  if (found == scene.views.end() || found->image_path.empty() || !is_present(found->image_path)) {
    return;
  }
  const auto index = static_cast<int>(found - scene.views.begin());
  View loaded = loaded_view(scene, index, /*with_image=*/true, warnings);
  view.photograph = std::move(loaded.image);
  view.valid = std::move(loaded.valid);
}

void print_row(const std::string& name, const Json& row) {
  const auto decibels = [](const Json& value) {
    return value.is_string() ? value.get<std::string>() : number(value, "%.2f");
  };
  std::printf("%-20s %8s %8s %8s %8s %8s %8s %8s\n",
              name.c_str(),
              decibels(row["psnr"]).c_str(),
              percent(row["a"]["unseen"]).c_str(),
              percent(row["b"]["unseen"]).c_str(),
              decibels(row["a"]["psnr"]).c_str(),
              decibels(row["b"]["psnr"]).c_str(),
              decibels(row["a"]["psnr_shared"]).c_str(),
              decibels(row["b"]["psnr_shared"]).c_str());
}

void print_splat_table(const Json& report) {
  std::printf("A: %s, %zu splats\nB: %s, %zu splats\n",
              report["a"]["file"].get<std::string>().c_str(),
              report["a"]["splats"].get<size_t>(),
              report["b"]["file"].get<std::string>().c_str(),
              report["b"]["splats"].get<size_t>());
  std::printf("%-20s %8s %8s %8s %8s %8s %8s %8s\n",
              "PSNR [dB]",
              "A to B",
              "A unseen",
              "B unseen",
              "A photo",
              "B photo",
              "A shared",
              "B shared");
  for (const Json& view : report["views"]) print_row(view["name"].get<std::string>(), view);
  print_row("all", report);
}

Json file_json(const std::filesystem::path& path, const GaussianFile& file) {
  return {{"file", printable(path)}, {"format", file.format}, {"splats", file.gaussians.size()}};
}

}  // namespace

void add_splat_compare_options(CLI::App& command, SplatCompareArgs& args) {
  const OptionGroup group(command, "Two files of splats");
  auto* scene = command.add_option(
      "--scene",
      args.scene,
      "Look from the cameras of this scene or model, and compare with its photographs; default: "
      "from eight places around the splats");
  command
      .add_option("--views",
                  args.views,
                  "Of them these: names or indices; default: those a model held out, else up to "
                  "twelve spread over all")
      ->needs(scene);
  command.add_option("--pictures",
                     args.pictures,
                     "Folder for a picture per camera: photograph, A, B and four times their "
                     "difference; unseen pixels in magenta");
}

bool holds_splats(const std::filesystem::path& path) {
  const std::string ending = lower_extension(path);
  const bool is_sog = ending == ".sog" || ending == ".json";  // the latter of one that is unpacked
  return is_bare_splat_name(path) || is_sog || ending == ".ksplat" || is_splat_file(path);
}

void run_splat_compare(const std::filesystem::path& a,
                       const std::filesystem::path& b,
                       const SplatCompareArgs& args,
                       const CommonOptions& common) {
  if (!args.pictures.empty()) {
    keep_apart(args.pictures, a);
    keep_apart(args.pictures, b);
    if (!args.scene.empty()) keep_apart(args.pictures, args.scene);
  }
  Terminal terminal(common.quiet, common.strict);
  std::optional<Scene> scene;
  if (!args.scene.empty()) scene = scene_in(args.scene);
  const GaussianFile first = read_splats(a, scene ? std::optional(scene->frame) : std::nullopt);
  const GaussianFile second = read_splats(b, first.frame);
  terminal.warn(first.warnings);
  terminal.warn(second.warnings);
  const Progress progress = terminal.begin("compare");
  std::vector<ComparedView> views =
      scene ? views_of(*scene, args)
            : views_around(first.gaussians, second.gaussians, part_of(progress, 0, 0.3));
  std::vector<std::string> warnings;
  const auto load = [&](ComparedView& view) {
    if (scene) load_photograph(*scene, warnings, view);
  };
  std::function<void(const std::string&, const ColorImage&)> show;
  if (!args.pictures.empty()) {
    make_output_folder(args.pictures);
    show = [&](const std::string& name, const ColorImage& picture) {
      write_png(args.pictures / (name + ".png"), picture);
    };
  }
  const SplatComparison found = compare_splats(
      first.gaussians, second.gaussians, std::move(views), load, show, part_of(progress, 0.3, 1));
  (void)terminal.end(std::to_string(found.views.size()) + " pictures of each");
  Json report = splat_comparison_to_json(found);
  report["a"].update(file_json(a, first));
  report["b"].update(file_json(b, second));
  report["cameras"] = scene ? "scene" : "around";
  if (common.json) {
    print_report(report);
  } else {
    print_splat_table(report);
  }
  terminal.warn(warnings);
  terminal.warn(lacking_words(found.all));
}

}  // namespace cgs
