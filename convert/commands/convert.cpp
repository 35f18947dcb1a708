// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/splats/conversion.h"
#include "convert/text/report_json.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct ConvertArgs {
  ConversionRequest request;
  std::string from = "best";
  CommonOptions common;
};

VirtualPlacement placement_named(const std::string& name) {
  if (name == "best") return VirtualPlacement::Best;
  if (name == "outside") return VirtualPlacement::Outside;
  require(name == "inside", "--look-from must be best, outside or inside", name);
  return VirtualPlacement::Inside;
}

void run_convert(const ConvertArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.request.output, args.request.input);
  ConversionRequest request = args.request;
  request.volume.cameras.placement = placement_named(args.from);
  request.volume.cameras.validate();
  request.volume.memory_limit = stated_memory_limit(args.common);
  Terminal terminal(args.common.quiet, args.common.strict);
  const nlohmann::ordered_json report = convert_file(request, terminal);
  if (args.common.json) print_report(report);
}

}  // namespace

void add_convert(CLI::App& app) {
  auto args = std::make_shared<ConvertArgs>();
  ConversionRequest& request = args->request;
  auto* cmd = app.add_subcommand(
      "convert", "Splats, volumes and meshes of any program to other files, by their endings");
  cmd->add_option("input", request.input, "File, or model folder")->required();
  cmd->add_option("output", request.output, "File to write")->required();
  cmd->add_option("--as", request.as, "mesh or splats, for a .ply or .glb made from splats");
  cmd->add_flag("--open", request.open_surface, "Leave the mesh open instead of closing it");
  cmd->add_option("--voxel-size",
                  request.volume.voxel_size,
                  "Edge of a voxel, e.g. 5mm, or in scene units; default: from the pixel size");
  cmd->add_option("--simplify",
                  request.simplify,
                  "Largest error of simplified meshes, e.g. 2mm; default: a quarter of a voxel, "
                  "none for meshes and splats without cameras; 0 = do not simplify");
  cmd->add_option("--compression-error",
                  request.compression_error,
                  "Largest move of a vertex by compression in a .glb, e.g. 0.2mm");
  cmd->add_flag("--filter-floaters",
                request.filter_floaters,
                "Leave out splats that float in free space: haze, needles, small islands");
  add_glb_option(*cmd, request.encoding);
  add_local_origin_option(*cmd, request.local_origin, "The .glb");
  cmd->add_option("--assume-unit", request.assume_unit, "What one unit is: m, cm, mm, in, ft");
  cmd->add_option("--up",
                  request.up,
                  "Direction that is up, three numbers; default: as the input says, else 0 0 1 for "
                  "meshes and 0 -1 0 for splats")
      ->expected(3);
  cmd->add_option("--look-from", args->from, "Virtual cameras: best, outside or inside")
      ->capture_default_str();
  cmd->add_option("--virtual-views", request.volume.cameras.views, "Number of virtual cameras")
      ->capture_default_str();
  cmd->add_option("--virtual-size", request.volume.cameras.size, "Side of their pictures in pixels")
      ->capture_default_str();
  cmd->add_option("--spz-version", request.spz_version, "2 or 3")->capture_default_str();
  add_common_options(*cmd, args->common);
  cmd->footer(conversion_table() + "Example: cgs convert statue.spz statue.glb");
  cmd->callback([args] { run_convert(*args); });
}

}  // namespace cgs
