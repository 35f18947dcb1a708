// SPDX-License-Identifier: GPL-3.0-or-later
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/files/volume_file.h"
#include "convert/model/depth_fusion.h"
#include "convert/model/fusion.h"
#include "convert/model/memory_plan.h"
#include "convert/text/length.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct FuseArgs {
  DepthFusionRequest request;  // its scene may be a model
  std::filesystem::path output;
  std::optional<EstimatedSurface> estimated;
  CommonOptions common;
};

bool is_model(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "gaussians.ply", ignored) ||
         std::filesystem::exists(folder / "model/gaussians.ply", ignored);
}

void refuse_depth_options(const DepthFusionRequest& request) {
  const SceneOptions& options = request.options;
  for (const auto& [option, is_given] :
       {std::pair("--views", !options.views.empty()),
        std::pair("--chunk", !options.chunk.empty()),
        std::pair("--downscale", options.downscale.has_value()),
        std::pair("--depth", !options.depth.folder.empty()),
        std::pair("--depth-kind", options.depth.kind != DepthKind::Unknown),
        std::pair("--depth-scale", options.depth.scale != 0),
        std::pair("--assume-unit", !request.assume_unit.empty()),
        std::pair("--up", !request.up.empty())}) {
    if (!is_given) continue;
    throw InvalidInput(std::string(option) + " is for folders of depth frames; " +
                       printable(request.scene) + " is a model, whose training was told");
  }
}

void print_json(const FuseArgs& args,
                const TsdfReport& fusion,
                const Frame& frame,
                nlohmann::ordered_json report) {
  report.update(fusion_to_json(fusion, frame));
  if (args.common.json) std::cout << json_text(report) << "\n";
}

void run_fuse(const FuseArgs& args) {
  limit_threads(args.common.threads);
  const DepthFusionRequest& request = args.request;
  keep_apart(args.output, request.scene);
  if (lower_extension(args.output) != ".vdb") {
    throw InvalidInput(printable(args.output) + " is no name of a volume: write NAME.vdb");
  }
  Terminal terminal(args.common.quiet, args.common.strict);
  if (is_model(request.scene)) {
    refuse_depth_options(request);
    const Model model = read_model(request.scene);
    terminal.warn(model.scene.warnings);
    const FusedVolume fused = fuse_model(model,
                                         {length_or_zero(request.voxel_size, model.scene.frame),
                                          args.estimated.value_or(EstimatedSurface::FillOnly),
                                          memory_budget(request.memory_limit)},
                                         terminal.begin("fuse"));
    write_volume(args.output, fused.volume, model.scene.frame);
    terminal.end("voxel " + format_length(fused.report.voxel_size, model.scene.frame));
    print_json(args, fused.report, model.scene.frame, {});
    return;
  }
  if (args.estimated) {
    throw InvalidInput("--estimated is for models; " + printable(request.scene) +
                       " holds depth frames, of which nothing is estimated");
  }
  const DepthFusion fusion = fuse_depth(request, terminal.begin("fuse"));
  terminal.note(fusion.notes);
  terminal.warn(fusion.warnings);
  write_volume(args.output, fusion.fused.volume, fusion.frame);
  terminal.end(std::to_string(fusion.frames) + " frames, voxel " +
               format_length(fusion.fused.report.voxel_size, fusion.frame));
  print_json(args,
             fusion.fused.report,
             fusion.frame,
             {{"frames", fusion.frames}, {"disagreement", fusion.disagreement}});
}

}  // namespace

void add_fuse(CLI::App& app) {
  auto args = std::make_shared<FuseArgs>();
  auto* cmd = app.add_subcommand(
      "fuse",
      "Model or measured depth frames to OpenVDB volume: signed distance, weight, colour, free / "
      "occupied / estimated / never seen");
  DepthFusionRequest& request = args->request;
  cmd->add_option("input",
                  request.scene,
                  "Model folder, e.g. out/portal/model, or scene folder with metric depth")
      ->required();
  cmd->add_option("-o,--output", args->output, "Volume to write (.vdb)")->required();
  cmd->add_option("--voxel-size",
                  request.voxel_size,
                  "Edge of a voxel, e.g. 5mm, or in scene units; default: from the pixel size");
  add_estimated_option(*cmd, args->estimated);
  add_common_options(*cmd, args->common);
  cmd->add_option("--views", request.options.views, "Frames: names or indices; default: all");
  cmd->add_option("--downscale",
                  request.options.downscale,
                  "Divide the size of photographs by this; default: down to that of the depth");
  add_depth_options(*cmd, request.options);
  cmd->add_option("--assume-unit",
                  request.assume_unit,
                  "What a unit of the cameras is (m, cm, mm, in, ft), where the scene does not "
                  "say; default m");
  cmd->add_option("--up",
                  request.up,
                  "World direction that is up, three numbers; default: judged by the cameras")
      ->expected(3);
  cmd->footer(
      "Example: cgs fuse out/portal/model --voxel-size 10mm -o portal.vdb\n"
      "         cgs fuse rgbd/desk --depth-scale 5000 --voxel-size 5mm -o desk.vdb\n"
      "A depth frame counts as one view, measured to 0.5 % of its depth (one standard deviation),\n"
      "as in cgs train: what two or more frames measured is observed, what one did, single view.\n"
      "Frames are read one after the other, up to three times: memory follows the surface.");
  cmd->callback([args] {
    args->request.memory_limit = stated_memory_limit(args->common);
    run_fuse(*args);
  });
}

}  // namespace cgs
