// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/figures.h"
#include "convert/html.h"
#include "convert/length.h"
#include "convert/measured_file.h"
#include "convert/mesh_files.h"
#include "convert/orthophoto_files.h"
#include "convert/terminal.h"
#include "convert/thickness_figures.h"
#include "io/dxf.h"
#include "io/json_file.h"
#include "io/mesh_arrays.h"
#include "io/svg.h"
#include "libcgs/core/error.h"
#include "meshing/geodesic.h"
#include "meshing/section.h"
#include "meshing/shape_fit.h"
#include "meshing/surface_measures.h"
#include "meshing/thickness.h"

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
};

// The mesh with what every figure needs, and where figures go.
class Measuring {
 public:
  Measuring(MeasurableMesh mesh, FigureUnit unit, bool json)
      : mesh_(std::move(mesh)), unit_(std::move(unit)), json_(json) {}

  void figure(const std::string& name,
              const MeasuredValue& value,
              const Json& more = Json::object()) {
    Json out = figure_json(value, unit_, mesh_.states_provenance());
    out.update(more);
    figures[name] = std::move(out);
    say(name, figure_text(value, unit_, mesh_.states_provenance()));
  }
  void say(const std::string& name, const std::string& text) const {
    if (!json_) std::printf("%-12s %s\n", name.c_str(), text.c_str());
  }

  void area() { figure("area", surface_area(mesh_)); }
  void volume();
  void bounds();
  void distance(const std::vector<std::string>& ends);
  void along(const std::vector<std::string>& ends);
  void section(const MeasureArgs& args);
  void fit(const MeasureArgs& args);
  void orthophoto(const OrthophotoRequest& request);
  void thickness();
  void thickness_at(const std::vector<std::string>& points);
  void thickness_ply(const std::filesystem::path& path);
  void certificate();

  Json figures = Json::object();

 private:
  void require_inside(const char* option);
  Json surface_shares(const MeasuredValue& area) const;
  SurfacePoint pick(const std::string& text);
  Json point_json(const Eigen::Vector3d& internal) const {
    const Eigen::Vector3d p = mesh_.file_from_internal(internal);
    return {p.x(), p.y(), p.z()};
  }
  Json picked_json(const std::string& asked, const SurfacePoint& point) const;
  void say_moved(const Json& from, const Json& to) const;
  const Certificate& certified() {
    if (!certificate_) certificate_ = certify(mesh_.mesh);
    return *certificate_;
  }
  const NearestSurface& surface() {
    if (!surface_) surface_ = std::make_unique<NearestSurface>(mesh_);
    return *surface_;
  }

  MeasurableMesh mesh_;
  FigureUnit unit_;
  bool json_;
  std::optional<Certificate> certificate_;
  std::unique_ptr<NearestSurface> surface_;
};

// Of an area, by provenance; null where the mesh states none.
Json Measuring::surface_shares(const MeasuredValue& area) const {
  if (!mesh_.states_provenance()) return nullptr;
  Json out = Json::object();
  for (const Provenance label : kProvenanceOrder) {
    out[provenance_key(label)] = area.by_provenance.at(static_cast<size_t>(label)) / area.value;
  }
  return out;
}

std::string shares_text(const MeasuredValue& area) {
  std::string out;
  for (const Provenance label : kProvenanceOrder) {
    const double part = area.by_provenance.at(static_cast<size_t>(label));
    if (part == 0) continue;
    out += (out.empty() ? "" : ", ") + number(100 * part / area.value, "%.3g") + " % " +
           std::string(provenance_name(label));
  }
  return out;
}

void Measuring::volume() {
  const Certificate& c = certified();
  if (!c.closed || !c.oriented_outward) {
    const char* const reason =
        c.closed ? "its faces disagree on which side is outside" : "the surface is not closed";
    figures["volume"] = {{"value", nullptr}, {"reason", reason}};
    say("volume", std::string("none: ") + reason);
    return;
  }
  const MeasuredValue value = enclosed_volume(mesh_);
  const MeasuredValue around = surface_area(mesh_);
  const double sigma = figure_sigma(value, unit_);
  const double unstated = (1 - value.stated) * figure_value(around, unit_);
  Json more = {{"area_without_sigma", unstated}};
  if (std::isfinite(sigma)) {
    more["interval"] = {figure_value(value, unit_) - 2 * sigma,
                        figure_value(value, unit_) + 2 * sigma};
  }
  // Nobody sees a volume: what can be observed of it is the surface around.
  Json out = figure_json(value, unit_, false);
  for (const Provenance label : kProvenanceOrder) out.erase(provenance_key(label));
  out.update(more);
  out["surface_shares"] = surface_shares(around);
  figures["volume"] = out;
  say("volume", figure_text(value, unit_, false));
  if (mesh_.states_provenance()) say("", "the surface around it: " + shares_text(around));
  if (value.stated > 0 && value.stated < 1) {
    char text[200];  // NOLINT(modernize-avoid-c-arrays)
    std::snprintf(text,
                  sizeof(text),
                  "%.3g %s^2 of the surface state no sigma: as far as they are off, the volume "
                  "changes by as much times this area",
                  unstated,
                  unit_.name.c_str());
    say("", text);
  }
}

void Measuring::bounds() {
  const OrientedBox box = oriented_box(mesh_);
  constexpr std::array<const char*, 3> kNames = {"length", "width", "height"};
  Json axes = Json::array();
  for (int k = 0; k < 3; ++k) {
    axes.push_back({box.axes(0, k), box.axes(1, k), box.axes(2, k)});
  }
  figures["bounds"] = {{"center", point_json(box.center)}, {"axes", axes}};
  for (size_t k = 0; k < 3; ++k) {
    figures["bounds"][kNames.at(k)] =
        figure_json(box.extents.at(k), unit_, mesh_.states_provenance());
    say(std::string("box ") + kNames.at(k),
        figure_text(box.extents.at(k), unit_, mesh_.states_provenance()));
  }
}

SurfacePoint Measuring::pick(const std::string& text) {
  return surface().nearest(mesh_.internal_from_file(parse_point(text)));
}

Json Measuring::picked_json(const std::string& asked, const SurfacePoint& point) const {
  const Eigen::Vector3d wanted = mesh_.internal_from_file(parse_point(asked));
  const SurfaceEvidence evidence = evidence_at(mesh_, point);
  Json out = {{"point", point_json(point.position)},
              {"moved", (point.position - wanted).norm() * unit_.length},
              {"sigma", nullptr},
              {"provenance", nullptr}};
  if (std::isfinite(evidence.sigma)) out["sigma"] = evidence.sigma * unit_.length;
  if (mesh_.states_provenance()) out["provenance"] = provenance_name(evidence.provenance);
  return out;
}

// Measured is between points of the surface, the nearest to those that were given.
void Measuring::say_moved(const Json& from, const Json& to) const {
  say("",
      "the points given lie " + number(from["moved"].get<double>(), "%.3g") + " and " +
          number(to["moved"].get<double>(), "%.3g") + " " + unit_.name + " off the surface");
}

void Measuring::distance(const std::vector<std::string>& ends) {
  const SurfacePoint a = pick(ends[0]);
  const SurfacePoint b = pick(ends[1]);
  const Json from = picked_json(ends[0], a);
  const Json to = picked_json(ends[1], b);
  figure("distance", straight_distance(mesh_, a, b), {{"from", from}, {"to", to}});
  say_moved(from, to);
}

void Measuring::along(const std::vector<std::string>& ends) {
  const SurfacePoint a = pick(ends[0]);
  const SurfacePoint b = pick(ends[1]);
  const SurfacePath path = distance_along(mesh_, a, b);
  const Json from = picked_json(ends[0], a);
  const Json to = picked_json(ends[1], b);
  Json points = Json::array();
  for (const Eigen::Vector3d& p : path.points) points.push_back(point_json(p));
  figure("along",
         path.length,
         {{"from", from}, {"to", to}, {"exact", path.exact}, {"points", points}});
  say_moved(from, to);
  if (!path.exact) say("", "an upper bound: the surface has too many faces for the exact way");
}

void Measuring::section(const MeasureArgs& args) {
  const CutPlane plane = parse_plane(args.section, mesh_);
  const Section cut = cgs::section(mesh_, plane);
  if (cut.lines.empty())
    throw InvalidInput("--section " + args.section + " does not meet the mesh");
  figure("section_length", cut.length, {{"lines", cut.lines.size()}, {"open", cut.open_lines}});
  figure("section_area", cut.area);
  for (const Provenance label : kProvenanceOrder) {
    figures["section_area"].erase(provenance_key(label));
  }
  if (args.svg.empty() && args.dxf.empty()) return;
  Drawing drawing = section_drawing(cut, plane, mesh_, unit_);
  drawing.title = args.mesh.filename().string() + ", section " + args.section;
  drawing.notes.insert(drawing.notes.begin(),
                       {"length " + figure_text(cut.length, unit_, mesh_.states_provenance()),
                        "enclosed area " + figure_text(cut.area, unit_, false)});
  if (!args.svg.empty()) write_svg(args.svg, drawing);
  if (!args.dxf.empty()) write_dxf(args.dxf, drawing);
}

void Measuring::fit(const MeasureArgs& args) {
  const Shape shape = args.fit == "plane"    ? Shape::Plane
                      : args.fit == "sphere" ? Shape::Sphere
                                             : Shape::Cylinder;
  const SurfacePoint at = pick(args.at);
  const ShapeFit fit = fit_shape(mesh_, shape, at.position, parse_length(args.radius, mesh_.frame));
  const auto length = [&](double value) { return value * unit_.length; };
  Json out = {{"shape", args.fit},
              {"point", point_json(fit.point)},
              {"point_sigma", length(fit.point_sigma)},
              {"rms", length(fit.rms)},
              {"max", length(fit.largest)},
              {"unit", unit_.name},
              {"vertices", fit.vertices},
              {"area", figure_json(fit.area, unit_, mesh_.states_provenance())}};
  if (shape != Shape::Sphere) {
    out["direction"] = {fit.direction.x(), fit.direction.y(), fit.direction.z()};
    out["direction_sigma_degrees"] = fit.direction_sigma * 180 / M_PI;
  }
  if (shape != Shape::Plane) {
    out["radius"] = figure_json(fit.radius, unit_, mesh_.states_provenance());
    say("radius", figure_text(fit.radius, unit_, mesh_.states_provenance()));
  }
  const Eigen::Vector3d p = mesh_.file_from_internal(fit.point);
  char text[300];  // NOLINT(modernize-avoid-c-arrays)
  std::snprintf(text,
                sizeof(text),
                "%s through (%.9g, %.9g, %.9g) ± %.3g, direction (%.6f, %.6f, %.6f) ± %.3g "
                "degrees; residuals %.3g rms, %.3g max [%s], %zu vertices",
                args.fit.c_str(),
                p.x(),
                p.y(),
                p.z(),
                length(fit.point_sigma),
                fit.direction.x(),
                fit.direction.y(),
                fit.direction.z(),
                fit.direction_sigma * 180 / M_PI,
                length(fit.rms),
                length(fit.largest),
                unit_.name.c_str(),
                fit.vertices);
  say("fit", text);
  figures["fit"] = std::move(out);
}

void Measuring::orthophoto(const OrthophotoRequest& request) {
  const Json out = write_orthophoto(request, mesh_, unit_);
  char text[300];  // NOLINT(modernize-avoid-c-arrays)
  std::snprintf(text,
                sizeof(text),
                "%d x %d pixels of %.6g %s; heights %.6g to %.6g %s%s",
                out["width"].get<int>(),
                out["height"].get<int>(),
                out["pixel_size"].get<double>(),
                unit_.name.c_str(),
                out["lowest"].get<double>(),
                out["highest"].get<double>(),
                unit_.name.c_str(),
                out["height_zero"] == 0 ? "" : ", in the file from height_zero of --json");
  say("orthophoto", text);
  if (mesh_.mesh.colors.empty()) say("", "all grey: this mesh has no colours of vertices");
  for (const Provenance label : kProvenanceOrder) {
    const Json& share = out[provenance_key(label)];
    if (share.is_null() || share == 0) continue;
    std::snprintf(text, sizeof(text), "%.2f %%", 100 * share.get<double>());
    say("", std::string(text) + " of what is shown: " + std::string(provenance_name(label)));
  }
  for (const Json& file : out["files"]) say("", printable(file.get<std::string>()));
  figures["orthophoto"] = out;
}

// Inside out, gaps between parts would be taken for their thickness.
void Measuring::require_inside(const char* option) {
  if (!certified().closed || certified().oriented_outward) return;
  throw InvalidInput(std::string(option) +
                     " needs to know what is inside, but faces of this closed mesh disagree on it "
                     "or all look inward; cgs filter --op repair turns them");
}

void Measuring::thickness() {
  require_inside("--thickness");
  constexpr size_t kSamples = 20'000;
  const ThicknessSummary summary = summarize_thickness(mesh_, surface(), kSamples);
  figures["thickness"] = thickness_json(summary, unit_);
  say("thickness", thickness_text(summary.seen, unit_));
  if (mesh_.states_provenance()) {
    say("",
        "where no photograph shows the near or the far side: " +
            thickness_text(summary.unseen, unit_));
  }
  if (summary.without_far_side > 0) {
    char text[80];  // NOLINT(modernize-avoid-c-arrays)
    std::snprintf(text, sizeof(text), "%.2f %% have no far side", 100 * summary.without_far_side);
    say("", text);
  }
}

void Measuring::thickness_at(const std::vector<std::string>& points) {
  require_inside("--thickness-at");
  const ThicknessGauge gauge(mesh_, surface());
  Json all = Json::array();
  for (const std::string& text : points) {
    const SurfacePoint from = pick(text);
    const Thickness found = gauge.at(from);
    Json one = {{"value", nullptr}, {"from", picked_json(text, from)}, {"to", nullptr}};
    if (found.has_far_side()) {
      one.update(figure_json(found.value, unit_, mesh_.states_provenance()));
      const SurfaceEvidence there = evidence_at(mesh_, found.far_side);
      one["to"] = {{"point", point_json(found.far_side.position)}, {"provenance", nullptr}};
      if (mesh_.states_provenance()) {
        one["to"]["provenance"] = provenance_name(there.provenance);
      }
    }
    say("thickness",
        found.has_far_side() ? figure_text(found.value, unit_, mesh_.states_provenance())
                             : "none: there is no far side");
    all.push_back(std::move(one));
  }
  figures["thickness_at"] = std::move(all);
}

void Measuring::thickness_ply(const std::filesystem::path& path) {
  require_inside("--thickness-ply");
  write_thickness_ply(path, mesh_, thickness_of_vertices(mesh_, surface()));
}

void Measuring::certificate() {
  figures["certificate"] = certificate_to_json(certified(), mesh_.mesh, mesh_.frame);
  say("certificate", certificate_line(certified()));
}

void keep_outputs_apart(const MeasureArgs& args) {
  std::vector<std::filesystem::path> outputs = {args.svg, args.dxf, args.thickness_ply};
  if (!args.orthophoto.prefix.empty()) {
    for (const auto& file : orthophoto_files(args.orthophoto.prefix)) outputs.push_back(file);
  }
  for (const auto& output : outputs) {
    if (!output.empty()) keep_apart(output, args.mesh);
  }
}

void run_measure(const MeasureArgs& args) {
  limit_threads(args.common.threads);
  keep_outputs_apart(args);
  const Terminal terminal(args.common.quiet, args.common.strict);
  MeasurableFile file = read_measured(args.mesh, args.assume_unit);
  terminal.warn(file.warnings);
  if (file.content.mesh.faces.empty() && !args.bounds) {
    throw BadInput(Defect::Empty,
                   args.mesh,
                   "a point cloud of " + std::to_string(file.content.points.size()) +
                       " points has no surface to measure; only --bounds works");
  }
  const FigureUnit unit = figure_unit(file.content.frame, args.unit);
  const Json about = measured_json(args.mesh, file.content, unit);
  if (!args.common.json) std::printf("%s\n", measured_line(args.mesh, file.content, unit).c_str());
  const bool all = args.asks_for_nothing();
  Measuring measuring(std::move(file.content), unit, args.common.json);
  if (args.area || all) measuring.area();
  if (args.volume || all) measuring.volume();
  if (args.bounds || all) measuring.bounds();
  if (!args.distance.empty()) measuring.distance(args.distance);
  if (!args.along.empty()) measuring.along(args.along);
  if (!args.section.empty()) measuring.section(args);
  if (!args.fit.empty()) measuring.fit(args);
  if (!args.orthophoto.prefix.empty()) measuring.orthophoto(args.orthophoto);
  if (args.thickness) measuring.thickness();
  if (!args.thickness_at.empty()) measuring.thickness_at(args.thickness_at);
  if (!args.thickness_ply.empty()) measuring.thickness_ply(args.thickness_ply);
  if (all) measuring.certificate();
  if (args.common.json) {
    std::cout << json_text({{"mesh", about}, {"figures", measuring.figures}}) << "\n";
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
                                "Write PREFIX.png, PREFIX.tif (heights), PREFIX.provenance.png and "
                                "a world file for each");
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
  cmd->add_option("mesh", args->mesh, "Mesh, ours or of others: .ply, .obj, .stl, .off, .3mf, .glb")
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
