// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/commands/measuring.h"
#include "convert/measure/measured_file.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

struct MeasureArgs {
  std::filesystem::path mesh;
  std::vector<std::string> distance;
  std::vector<std::string> along;
  bool area = false;
  bool volume = false;
  bool bounds = false;
  std::string section;
  std::filesystem::path svg;
  std::filesystem::path dxf;
  std::string fit;
  std::string at;
  std::string radius;
  OrthophotoRequest orthophoto;
  bool thickness = false;
  std::vector<std::string> thickness_at;
  std::filesystem::path thickness_ply;
  std::string unit;
  std::string assume_unit;
  CommonOptions common;

  bool asks_for_nothing() const {
    return distance.empty() && along.empty() && !area && !volume && !bounds && section.empty() &&
           fit.empty() && orthophoto.prefix.empty() && !thickness && thickness_at.empty() &&
           thickness_ply.empty();
  }
  bool asks_for_bounds_alone() const {
    MeasureArgs rest = *this;
    rest.bounds = false;
    return bounds && rest.asks_for_nothing();
  }
};

void check_outputs(const MeasureArgs& args) {
  std::vector<std::filesystem::path> outputs = {args.svg, args.dxf, args.thickness_ply};
  if (!args.orthophoto.prefix.empty()) {
    for (const auto& file : orthophoto_files(args.orthophoto.prefix)) outputs.push_back(file);
  }
  for (const auto& output : outputs) {
    if (!output.empty()) keep_apart(output, args.mesh);
  }
  require_ending(args.svg, ".svg", "--svg");
  require_ending(args.dxf, ".dxf", "--dxf");
  require_ending(args.thickness_ply, ".ply", "--thickness-ply");
  for (const auto& output : {args.svg, args.dxf, args.thickness_ply}) {
    if (!output.empty()) const AtomicFile can_be_written(output);  // before all the work
  }
}

void run_measure(const MeasureArgs& args) {
  let_interrupts_end();
  limit_threads(args.common.threads);
  check_outputs(args);
  const Terminal terminal(args.common.quiet, args.common.strict);
  MeasurableFile file = read_measured(args.mesh, args.assume_unit);
  terminal.warn(file.warnings);
  if (file.content.mesh.faces.empty() && !args.asks_for_bounds_alone()) {
    throw BadInput(Defect::Empty,
                   args.mesh,
                   "a point cloud of " + std::to_string(file.content.points.size()) +
                       " points has no surface to measure; only --bounds works");
  }
  const FigureUnit unit = figure_unit(file.content.frame, args.unit);
  const Json about = measured_json(args.mesh, file.content, unit);
  if (!args.common.json) std::printf("%s\n", measured_line(args.mesh, file.content, unit).c_str());
  const bool all = args.asks_for_nothing();
  Measuring measuring(args.mesh, std::move(file.content), unit, args.common.json);
  if (args.area || all) measuring.area();
  if (args.volume || all) measuring.volume();
  if (args.bounds || all) measuring.bounds();
  if (!args.distance.empty()) measuring.distance(args.distance);
  if (!args.along.empty()) measuring.along(args.along);
  if (!args.section.empty()) measuring.section(args.section, args.svg, args.dxf);
  if (!args.fit.empty()) measuring.fit(args.fit, args.at, args.radius);
  if (!args.orthophoto.prefix.empty()) measuring.orthophoto(args.orthophoto);
  if (args.thickness) measuring.thickness();
  if (!args.thickness_at.empty()) measuring.thickness_at(args.thickness_at);
  if (!args.thickness_ply.empty()) measuring.thickness_ply(args.thickness_ply);
  if (all) measuring.certificate();
  if (args.common.json) {
    print_report({{"mesh", about}, {"figures", measuring.figures()}});
  }
}

void add_figures(CLI::App& cmd, MeasureArgs& args) {
  cmd.add_option("--distance", args.distance, "Straight distance between two points, x,y,z each")
      ->expected(2);
  cmd.add_option("--along", args.along, "Shortest way over the surface between two points")
      ->expected(2);
  cmd.add_flag("--area", args.area, "Area of the surface");
  cmd.add_flag("--volume", args.volume, "Volume within a closed surface");
  cmd.add_flag("--bounds", args.bounds, "Smallest box around it, turned as it fits");
  auto* section = cmd.add_option(
      "--section", args.section, "Cut by a plane: z=1.5, or a point and a normal x,y,z/nx,ny,nz");
  cmd.add_option("--svg", args.svg, "Draw the section")->needs(section);
  cmd.add_option("--dxf", args.dxf, "Write the section for CAD programs")->needs(section);
  cmd.add_flag(
      "--thickness", args.thickness, "Thickness: largest balls inside, all over the surface");
  cmd.add_option("--thickness-at", args.thickness_at, "Thickness at points, x,y,z each");
  cmd.add_option("--thickness-ply", args.thickness_ply, "Write the mesh coloured by thickness");
  auto* fit = cmd.add_option("--fit", args.fit, "Fit a shape to a patch of the surface")
                  ->check(CLI::IsMember({"plane", "sphere", "cylinder"}));
  auto* at = cmd.add_option("--at", args.at, "Middle of the patch, x,y,z")->needs(fit);
  auto* radius =
      cmd.add_option("--radius", args.radius, "Radius of the patch, e.g. 5cm")->needs(fit);
  fit->needs(at)->needs(radius);
}

void add_orthophoto(CLI::App& cmd, OrthophotoRequest& request) {
  auto* prefix = cmd.add_option("--orthophoto",
                                request.prefix,
                                "Write PREFIX.png, PREFIX.tif (heights), PREFIX.provenance.png, a "
                                "world file for each, and PREFIX.orthophoto.json (unit, axes)");
  auto* side = cmd.add_option("--side", request.side, "Where it is seen from")
                   ->check(CLI::IsMember({"top", "front", "back", "left", "right"}))
                   ->capture_default_str()
                   ->needs(prefix);
  auto* up = cmd.add_option("--up",
                            request.up,
                            "Direction that is up, three numbers; default: as "
                            "the file tells, else 0 0 1")
                 ->expected(3)
                 ->needs(prefix);
  cmd.add_option("--plane",
                 request.plane,
                 "Or seen across the plane of three points, x,y,z each: right is from the first to "
                 "the second, and they run counter-clockwise")
      ->expected(3)
      ->needs(prefix)
      ->excludes(side)
      ->excludes(up);
  cmd.add_option("--pixel-size", request.pixel_size, "Of the orthophoto, e.g. 1mm")->needs(prefix);
}

}  // namespace

void add_measure(CLI::App& app) {
  auto args = std::make_shared<MeasureArgs>();
  auto* cmd = app.add_subcommand(
      "measure", "Distances, areas, volumes, sections and fits on a mesh, each with its sigma");
  cmd->add_option("mesh",
                  args->mesh,
                  "Mesh, ours or of others: .ply, .obj, .stl, .off, .om, .3mf, .glb, .gltf")
      ->required();
  add_figures(*cmd, *args);
  add_orthophoto(*cmd, args->orthophoto);
  cmd->add_option("--unit", args->unit, "Unit of the figures; default m");
  cmd->add_option(
      "--assume-unit", args->assume_unit, "What a unit of the file is, where it does not say");
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Points are in the coordinates of the file and move to the nearest point of the surface.\n"
      "Without a figure: area, volume, bounds and certificate.\n"
      "Example: cgs measure out/portal/mesh/watertight.ply --distance -1,0,4 1,0,4 --unit mm\n"
      "         cgs measure part.stl --assume-unit mm --section z=12 --dxf section.dxf\n"
      "         cgs measure out/portal/mesh/watertight.ply --orthophoto facade --side front "
      "--pixel-size 5mm");
  cmd->callback([args] { run_measure(*args); });
}

}  // namespace cgs
