// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/run_options.h"

#include <algorithm>
#include <vector>

#include "convert/run/preview.h"
#include "convert/run/verification.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

size_t asked_size(const std::string& text) {
  constexpr size_t kLeast = 1000;  // of a file with nothing in it
  const size_t bytes = parse_file_size(text, "--max-size");
  if (bytes >= kLeast) return bytes;
  throw InvalidInput("--max-size " + text + " is " + std::to_string(bytes) +
                     " bytes, too few for any asset; write 800kB or 2MB");
}

void add_surface_options(CLI::App& command, RunArguments& args) {
  const OptionGroup group(command, "Surface and files");
  command.add_option("--voxel-size",
                     args.request.voxel_size,
                     "Edge of a voxel, e.g. 5mm, or in scene units; default: from the pixel size");
  command.add_option(
      "--simplify",
      args.request.simplify,
      "Largest error of simplified meshes where there is evidence, e.g. 2mm; four times "
      "that where inferred or estimated, as much again for asset.glb, whose photographs hold "
      "the colours; default: a quarter of a voxel; 0 = do not simplify");
  command.add_option("--compression-error",
                     args.request.compression_error,
                     "Largest error of the compressed mesh, e.g. 0.2mm; default: size / 16384");
  add_glb_option(command, args.request.glb_encoding);
  command.add_option("--texture",
                     args.request.texture,
                     "Pictures of watertight.obj and asset.glb: photographs, as they were taken; "
                     "atlas, one picture of what faces show of them; or atlas= with the size of "
                     "its pixels, e.g. atlas=2mm; default photographs");
  add_local_origin_option(
      command, args.request.local_origin, "What is in web/, but for splats.spz,");
  add_fill_option(command,
                  args.request.fill,
                  "What web/splats show where nothing was reconstructed: pieces of what is around "
                  "it, as splats tagged synthetic, which nothing measures");
  add_estimated_option(command, args.estimated);
  command
      .add_option(
          "--lods",
          args.request.lods,
          "Coarser levels of asset.glb to write, 0 to 5, with a tileset.json (3D Tiles) for "
          "viewers that show the one that the distance asks for; default 0")
      ->check(CLI::Range(size_t{0}, kMostLods).description("0 to " + std::to_string(kMostLods)));
}

void add_promises(CLI::App& command, RunArguments& args) {
  const OptionGroup group(command, "Promises, kept or refused");
  command.add_option("--max-error",
                     args.request.max_error,
                     "Every mesh written, asset.glb too but not its coarser levels, lies within "
                     "this of the fused surface, measured on the files, e.g. 1mm, or in scene "
                     "units; in place of --simplify and --compression-error");
  command.add_option("--max-size",
                     args.max_size,
                     "asset.glb with its textures is no larger, e.g. 2MB; leaves out the "
                     "least detail that is needed and says how much that is");
  command.add_option(
      "--budget",
      args.budget,
      "Time for all of it, e.g. 3min: tries small pictures, then takes the largest "
      "size and the training that this machine can do in it; in place of --downscale and "
      "--preset");
}

}  // namespace

void add_run_options(CLI::App& command, RunArguments& arguments) {
  add_scene_options(command, arguments.request.scene.options);
  add_camera_options(command, arguments.request.scene);
  add_medium_option(command, arguments.request.medium);
  add_scale_options(command, arguments.request.scene);
  add_surface_options(command, arguments);
  add_promises(command, arguments);
  add_training_options(command, arguments.training);
  for (const char* chosen : {"--downscale", "--preset", "--medium"}) {
    command.get_option("--budget")->excludes(command.get_option(chosen));
  }
  add_common_options(command, arguments.common);
}

void add_overwrite_option(CLI::App& command, RunRequest& request) {
  command.add_flag("-w,--overwrite", request.overwrite, "Replace the results of another run");
}

void keep_run_apart(const std::filesystem::path& output, const std::filesystem::path& scene) {
  keep_scene_apart(
      output, scene, {"model", "views", "mesh", "web", kPreviewFolder, kRecomputedFolder});
}

RunRequest run_request(const RunArguments& arguments) {
  RunRequest out = arguments.request;
  out.training = training_options(arguments.training);
  out.memory_limit = stated_memory_limit(arguments.common);
  out.estimated = arguments.estimated.value_or(out.estimated);
  if (!arguments.max_size.empty()) out.max_size = asked_size(arguments.max_size);
  if (!out.scene.assume_unit.empty()) (void)metres_in(out.scene.assume_unit, "--assume-unit");
  return out;
}

double stated_budget(const RunArguments& arguments) {
  const double budget = arguments.budget.empty() ? 0 : parse_seconds(arguments.budget, "--budget");
  const std::vector<std::string>& set = arguments.training.settings;
  const bool sets_steps = std::any_of(
      set.begin(), set.end(), [](const std::string& s) { return s.rfind("steps=", 0) == 0; });
  if (budget > 0 && sets_steps) {
    throw InvalidInput("--budget chooses the steps of the training; give it or --set steps");
  }
  return budget;
}

}  // namespace cgs
