// SPDX-License-Identifier: GPL-3.0-or-later
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
#include "convert/model/model.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct FuseArgs {
  std::vector<std::filesystem::path> inputs;  // models, or one folder of depth frames
  DepthFusionRequest request;                 // its scene is the first of them
  std::filesystem::path output;
  std::optional<EstimatedSurface> estimated;
  CommonOptions common;
};

bool is_model(const std::filesystem::path& folder) {
  return is_present(model_folder(folder) / "gaussians.ply");
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
        std::pair("--allow-external", options.allow_external),
        std::pair("--assume-unit", !request.assume_unit.empty()),
        std::pair("--up", !request.up.empty())}) {
    if (!is_given) continue;
    throw InvalidInput(std::string(option) + " is for folders of depth frames; " +
                       printable(request.scene) + " is a model, whose training was told");
  }
}

void refuse_other_than_models(const std::vector<std::filesystem::path>& inputs) {
  for (const std::filesystem::path& input : inputs) {
    if (lower_extension(input) != ".vdb") continue;
    throw InvalidInput(
        printable(input) +
        " is a volume, which does not tell how surely its free space is free; give the models "
        "that the volumes were made of: they are fused into one as if they were one model");
  }
  for (const std::filesystem::path& input : inputs) {
    if (is_model(input)) continue;
    throw InvalidInput(printable(input) + " is no model; only models are fused together");
  }
}

void print_json(const FuseArgs& args,
                const TsdfReport& fusion,
                const Frame& frame,
                nlohmann::ordered_json report) {
  report.update(fusion_to_json(fusion, frame));
  if (args.common.json) print_report(report);
}

ModelFusion model_fusion(const FuseArgs& args, const Frame& frame) {
  return {length_or_zero(args.request.voxel_size, frame, "--voxel-size"),
          args.estimated.value_or(EstimatedSurface::FillOnly),
          memory_budget(args.request.memory_limit)};
}

void fuse_one_model(const FuseArgs& args, Terminal& terminal) {
  refuse_depth_options(args.request);
  const Model model = read_model(args.request.scene);
  const Frame& frame = model.scene.frame;
  terminal.warn(model.scene.warnings);
  const FusedVolume fused = fuse_model(model, model_fusion(args, frame), terminal.begin("fuse"));
  write_volume(args.output, fused.volume, frame);
  terminal.end("voxel " + format_length(fused.report.voxel_size, frame));
  print_json(args, fused.report, frame, {});
}

void fuse_several_models(const FuseArgs& args, Terminal& terminal) {
  refuse_other_than_models(args.inputs);
  refuse_depth_options(args.request);
  const auto read = [&](size_t i) {
    return std::make_shared<const Model>(read_model(args.inputs[i]));
  };
  std::shared_ptr<const Model> first = read(0);  // tells what lengths mean, and is handed on once
  const ModelFusion request = model_fusion(args, first->scene.frame);
  const ModelSource source = {args.inputs.size(), [&](size_t i) {
                                return i == 0 && first ? std::exchange(first, nullptr) : read(i);
                              }};
  const JoinedVolume joined = fuse_models(source, request, terminal.begin("fuse"));
  write_volume(args.output, joined.fused.volume, joined.frame);
  terminal.end(std::to_string(joined.photographs) + " photographs of " +
               std::to_string(args.inputs.size()) + " models, " +
               std::to_string(joined.in_several) + " of them in several, voxel " +
               format_length(joined.fused.report.voxel_size, joined.frame));
  print_json(args,
             joined.fused.report,
             joined.frame,
             {{"models", args.inputs.size()},
              {"photographs", joined.photographs},
              {"in_several", joined.in_several}});
}

void fuse_frames(const FuseArgs& args, Terminal& terminal) {
  const DepthFusionRequest& request = args.request;
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

void run_fuse(const FuseArgs& args) {
  limit_threads(args.common.threads);
  for (const std::filesystem::path& input : args.inputs) keep_apart(args.output, input);
  if (lower_extension(args.output) != ".vdb") {
    throw InvalidInput(printable(args.output) + " is no name of a volume: write NAME.vdb");
  }
  { const AtomicFile can_be_written(args.output); }  // before all the work
  Terminal terminal(args.common.quiet, args.common.strict);
  if (args.inputs.size() > 1) {
    fuse_several_models(args, terminal);
  } else if (is_model(args.request.scene)) {
    fuse_one_model(args, terminal);
  } else {
    fuse_frames(args, terminal);
  }
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
                  args->inputs,
                  "Model folder, e.g. out/portal/model, several of one world, or a scene folder "
                  "with metric depth")
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
      "         cgs fuse out/facade/group_*/model -o facade.vdb\n"
      "         cgs fuse rgbd/desk --depth-scale 5000 --voxel-size 5mm -o desk.vdb\n"
      "A depth frame counts as one view, measured to 0.5 % of its depth (one standard deviation),\n"
      "as in cgs train: what two or more frames measured is observed, what one did, single view.\n"
      "Several models, as of the groups of cgs split, become one volume: that of a model of all "
      "their views.\n"
      "Frames are read one after the other, up to three times: memory follows the surface.");
  cmd->callback([args] {
    args->request.scene = args->inputs.front();
    args->request.memory_limit = stated_memory_limit(args->common);
    run_fuse(*args);
  });
}

}  // namespace cgs
