// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/files/mesh_files.h"
#include "convert/files/volume_file.h"
#include "convert/model/memory_plan.h"
#include "convert/model/simplification.h"
#include "convert/text/report_json.h"
#include "convert/text/stated_frame.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/meshes/obj.h"
#include "meshing/surface/isosurface.h"

namespace cgs {

namespace {

struct MeshArgs {
  std::filesystem::path volume;
  std::filesystem::path output;
  std::vector<double> up;
  std::string assume_unit;
  std::string simplify;
  CommonOptions common;
};

void run_mesh_command(const MeshArgs& args) {
  limit_threads(args.common.threads);
  Terminal terminal(args.common.quiet, args.common.strict);
  const NewFolder folder(args.output);  // before all the work
  VolumeFile file = read_volume(args.volume);
  if (!args.assume_unit.empty()) {
    const std::string refused = assume_unit(file.frame, args.assume_unit);
    if (!refused.empty()) terminal.warn(refused);
  }
  const std::string assumed = settle_up(file.frame, args.up);
  if (!assumed.empty()) terminal.note({assumed});
  const Progress progress = terminal.begin("mesh");
  const auto options = simplify_options(args.simplify, file.volume.voxel_size, file.frame);
  TriangleMesh open = open_surface(file.volume, {});
  WatertightOptions closing;
  closing.memory_limit = memory_budget(stated_memory_limit(args.common));
  WatertightResult closed = watertight_surface(file.volume, closing, part_of(progress, 0.1, 0.5));
  const std::optional<Simplification> simplification =
      simplify_meshes(open, closed, options, part_of(progress, 0.5, 0.9));
  MeshFiles files = write_mesh_files(args.output, open, closed.mesh, file.frame);
  write_obj(args.output / "watertight.obj", closed.mesh, file.frame);
  files.written.emplace_back("watertight.obj");
  terminal.end(std::to_string(closed.mesh.faces.size()) + " faces, " +
               (closed.certificate.passed() ? "certified watertight" : "NOT certified"));
  for (const auto& [name, reason] : files.left_out) {
    terminal.say(name + " left out: " + reason);
  }
  if (!closed.certificate.passed()) {
    terminal.warn("the watertight mesh is NOT certified; --json says what is wrong with it");
  }
  if (!args.common.json) return;
  const nlohmann::ordered_json report = {
      {"certificate", certificate_to_json(closed.certificate, closed.mesh, file.frame)},
      {"method", closed.method},
      {"simplification", simplification_to_json(simplification, file.frame)},
      {"output", mesh_files_to_json(files)}};
  print_report(report);
}

}  // namespace

void add_mesh(CLI::App& app) {
  auto args = std::make_shared<MeshArgs>();
  auto* cmd =
      app.add_subcommand("mesh", "Volume to meshes: open surface, and watertight with certificate");
  cmd->add_option("volume", args->volume, "Volume written by fuse or run (.vdb)")->required();
  cmd->add_option("-o,--output", args->output, "Folder to write")->required();
  cmd->add_option("--up",
                  args->up,
                  "Direction that is up, three numbers; default: as the volume says, else 0 0 1")
      ->expected(3);
  cmd->add_option(
      "--assume-unit", args->assume_unit, "What a unit of the volume is, where it does not say");
  cmd->add_option(
      "--simplify",
      args->simplify,
      "Largest error of simplified meshes where there is evidence, e.g. 2mm; four times "
      "that where inferred or estimated; default: a quarter of a voxel; 0 = do not simplify");
  add_common_options(*cmd, args->common);
  cmd->footer("Example: cgs mesh portal.vdb --up 0 -1 0 -o out/mesh");
  cmd->callback([args] { run_mesh_command(*args); });
}

}  // namespace cgs
