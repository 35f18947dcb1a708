// SPDX-License-Identifier: GPL-3.0-or-later
#include <iostream>
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/fusion.h"
#include "convert/length.h"
#include "convert/volume_file.h"
#include "io/json_file.h"

namespace cgs {

namespace {

struct FuseArgs {
  std::filesystem::path model;
  std::filesystem::path output;
  std::string voxel_size;
  CommonOptions common;
};

void run_fuse(const FuseArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.output, args.model);
  Terminal terminal(args.common.quiet, args.common.strict);
  const size_t memory = stated_memory_limit(args.common);
  const Model model = read_model(args.model);
  terminal.warn(model.scene.warnings);
  const FusedVolume fused = fuse_model(model, args.voxel_size, memory, terminal.begin("fuse"));
  write_volume(args.output, fused.volume, model.scene.frame);
  terminal.end("voxel " + format_length(fused.report.voxel_size, model.scene.frame));
  if (args.common.json) {
    std::cout << json_text(fusion_to_json(fused.report, model.scene.frame)) << "\n";
  }
}

}  // namespace

void add_fuse(CLI::App& app) {
  auto args = std::make_shared<FuseArgs>();
  auto* cmd = app.add_subcommand(
      "fuse",
      "Model to OpenVDB volume: signed distance, weight, colour, free / occupied / never seen");
  cmd->add_option("model", args->model, "Model folder, e.g. out/portal/model")->required();
  cmd->add_option("-o,--output", args->output, "Volume to write (.vdb)")->required();
  cmd->add_option("--voxel-size",
                  args->voxel_size,
                  "Edge of a voxel, e.g. 5mm, or in scene units; default: from the pixel size");
  add_common_options(*cmd, args->common);
  cmd->footer("Example: cgs fuse out/portal/model --voxel-size 10mm -o portal.vdb");
  cmd->callback([args] { run_fuse(*args); });
}

}  // namespace cgs
