// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <numeric>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/model/camera_path_file.h"
#include "convert/model/hole_pictures.h"
#include "convert/model/model.h"
#include "convert/model/views.h"
#include "convert/report/film_page.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"
#include "libcgs/reconstruct/camera_path.h"

namespace cgs {

namespace {

struct RenderArgs {
  std::filesystem::path model;
  std::filesystem::path output;
  std::string views;
  std::string path;
  std::optional<int> frames;
  PictureOptions shown;
  bool holes = false;
  CommonOptions common;
};

constexpr int kFrames = 60;

void render_holes(const RenderArgs& args, const Model& model, Terminal& terminal) {
  const HolePictures made =
      write_hole_pictures(model, args.output, args.shown.fill, terminal.begin("holes"));
  terminal.end(std::to_string(made.pictures.size()) + " pictures see " + percent(made.covered) +
               " of the holes that " + std::to_string(made.candidates) + " cameras see");
  terminal.say("paint in the white of the masks, then cgs fill MODEL " + printable(args.output) +
               "; see " + printable(args.output / "README.txt"));
  if (args.common.json) print_report(hole_pictures_to_json(made));
}

void run_render(const RenderArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.output, args.model);
  Terminal terminal(args.common.quiet, args.common.strict);
  const Model model = read_model(args.model);
  if (args.shown.through_water && !model.scene.water) {
    throw InvalidInput("--water: " + printable(args.model) +
                       " states no water; it is of photographs that were trained on without "
                       "--medium water, or that showed none");
  }
  terminal.warn(model.scene.warnings);
  if (const std::string text = unknown_holes_warning(model); !text.empty()) terminal.warn({text});
  if (args.holes) {
    render_holes(args, model, terminal);
    return;
  }
  if (!args.path.empty()) {
    const bool is_file = lower_extension(args.path) == ".json";
    refuse_to_replace_path(args.output, is_file ? args.path : std::string());
    if (is_file && args.frames) {
      throw InvalidInput("--frames is for spiral and orbit; " + printable(args.path) +
                         " says which cameras there are");
    }
    const std::vector<Camera> path =
        is_file ? camera_path_from(args.path, model)
                : camera_path(model, args.path, args.frames.value_or(kFrames));
    const auto frames = write_path(model, path, args.output, terminal.begin("render"), args.shown);
    write_film_page(args.output, frames);
    terminal.end(std::to_string(path.size()) + " frames; film.html plays them");
    if (args.common.json) print_report(frames_to_json(frames));
    return;
  }
  std::vector<int> views(model.scene.views.size());
  std::iota(views.begin(), views.end(), 0);
  if (!args.views.empty()) views = select_views(model.scene, args.views);
  const auto written = write_views(model, views, args.output, terminal.begin("render"), args.shown);
  terminal.end(std::to_string(views.size()) + " views");
  if (args.common.json) print_report(views_to_json(written));
}

}  // namespace

void add_render(CLI::App& app) {
  auto args = std::make_shared<RenderArgs>();
  auto* cmd = app.add_subcommand(
      "render", "Model to EXR and PNG per camera: colour, depth, normal, support, holes");
  cmd->add_option("model", args->model, "Model folder, e.g. out/portal/model")->required();
  cmd->add_option("-o,--output", args->output, "Folder to write")->required();
  auto* views = cmd->add_option(
      "--views", args->views, "Cameras: names, or indices in name order from 0; default all");
  auto* path = cmd->add_option(
      "--path",
      args->path,
      "Pictures, hole masks and a page that plays them along a path instead: between (the input "
      "views), spiral (before them), orbit (once around what they look at), or a .json of cameras "
      "as in cameras.json");
  path->excludes(views);
  cmd->add_option("--frames", args->frames, "Number of pictures along a path; default 60")
      ->needs(path);
  cmd->add_flag(
         "--holes",
         args->holes,
         "Pictures to paint the holes of the model in, from few cameras that see nearly all "
         "of them, with masks, depth and cameras instead; cgs fill MODEL FOLDER takes them back")
      ->excludes(views)
      ->excludes(path);
  add_fill_option(*cmd, args->shown.fill);
  cmd->add_flag("--water",
                args->shown.through_water,
                "Put back the water that --medium water took out; default: pictures without it")
      ->excludes("--holes");
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Example: cgs render out/portal/model --views 0,2 -o out/views\n"
      "         cgs render out/portal/model --path spiral -o out/spiral; its frames as a film:\n"
      "         ffmpeg -framerate 24 -i out/spiral/frame_%04d.png -pix_fmt yuv420p "
      "-vf crop=trunc(iw/2)*2:trunc(ih/2)*2 portal.mp4\n"
      "         cgs render out/portal/model --holes -o out/holes");
  cmd->callback([args] { run_render(*args); });
}

}  // namespace cgs
