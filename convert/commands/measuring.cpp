// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/measuring.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "convert/files/mesh_files.h"
#include "convert/measure/measured_file.h"
#include "convert/measure/thickness_figures.h"
#include "convert/text/frame_json.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "io/bytes/mesh_arrays.h"
#include "io/drawings/dxf.h"
#include "io/drawings/svg.h"
#include "libcgs/core/error.h"
#include "meshing/measure/geodesic.h"
#include "meshing/measure/section.h"
#include "meshing/measure/shape_fit.h"
#include "meshing/measure/surface_measures.h"
#include "meshing/measure/thickness.h"
#include "meshing/mesh/shells.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

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

// \param point  of the fit, in coordinates of the file
std::string fit_text(const ShapeFit& fit,
                     const std::string& shape,
                     const Eigen::Vector3d& point,
                     const FigureUnit& unit) {
  std::array<char, 300> text{};
  std::snprintf(text.data(),
                text.size(),
                "%s through (%.9g, %.9g, %.9g) of the file, ± %.3g %s",
                shape.c_str(),
                point.x(),
                point.y(),
                point.z(),
                fit.point_sigma * unit.length,
                unit.name.c_str());
  std::string out = text.data();
  if (fit.shape != Shape::Sphere) {
    std::snprintf(text.data(),
                  text.size(),
                  ", direction (%.6f, %.6f, %.6f) ± %.3g degrees",
                  fit.direction.x(),
                  fit.direction.y(),
                  fit.direction.z(),
                  fit.direction_sigma * 180 / M_PI);
    out += text.data();
  }
  std::snprintf(text.data(),
                text.size(),
                "; residuals %.3g rms, %.3g max [%s], %zu vertices",
                fit.rms * unit.length,
                fit.largest * unit.length,
                unit.name.c_str(),
                fit.vertices);
  return out + text.data();
}

std::string scatter_text(const ShapeFit& fit, const FigureUnit& unit) {
  std::string out = "nothing states a sigma: ± tells what the scatter of vertices allows";
  if (fit.shape == Shape::Plane) return out;
  return out + ", for the radius " + number(fit.radius_scatter * unit.length, "%.3g") + " " +
         unit.name;
}

// A reason why a surface is not closed, and that its file may be what keeps faces apart.
std::string with_seams(const std::string& reason, const TriangleMesh& mesh) {
  const std::string seams = seams_text(mesh);
  return seams.empty() ? reason : reason + "; " + seams;
}

}  // namespace

void Measuring::figure(const std::string& name, const MeasuredValue& value, const Json& more) {
  figures_[name] = figure_json(value, unit_, mesh_.states_provenance());
  figures_[name].update(more);
  say(name, figure_text(value, unit_, mesh_.states_provenance()));
}

void Measuring::figure_without_parts(const std::string& name,
                                     const MeasuredValue& value,
                                     const Json& more) {
  Json& out = figures_[name] = figure_json(value, unit_, false);
  for (const Provenance label : kProvenanceOrder) out.erase(provenance_key(label));
  out.update(more);
  say(name, figure_text(value, unit_, false));
}

void Measuring::no_figure(const std::string& name, const std::string& reason) {
  figures_[name] = {{"value", nullptr}, {"reason", reason}};
  say(name, "none: " + reason);
}

void Measuring::say(const std::string& name, const std::string& text) const {
  if (!json_) std::printf("%-12s %s\n", name.c_str(), text.c_str());
}

const Certificate& Measuring::certified() {
  if (!certificate_) certificate_ = certify(mesh_.mesh);
  return *certificate_;
}

const NearestSurface& Measuring::surface() {
  if (!surface_) surface_ = std::make_unique<NearestSurface>(mesh_);
  return *surface_;
}

Json Measuring::point_json(const Eigen::Vector3d& internal) const {
  return vector_to_json(mesh_.file_from_internal(internal));
}

void Measuring::area() { figure("area", surface_area(mesh_)); }

// Of an area, by provenance; null where the mesh states none.
Json Measuring::surface_shares(const MeasuredValue& area) const {
  if (!mesh_.states_provenance()) return nullptr;
  Json out = Json::object();
  for (const Provenance label : kProvenanceOrder) {
    out[provenance_key(label)] = area.by_provenance.at(static_cast<size_t>(label)) / area.value;
  }
  return out;
}

void Measuring::volume() {
  const Certificate& c = certified();
  if (!c.closed || !c.oriented_outward) {
    std::string reason =
        c.closed ? "its faces look inward, or disagree on which side is outside; cgs filter --op "
                   "repair turns them"
                 : "the surface is not closed";
    if (!c.closed) reason = with_seams(reason, mesh_.mesh);
    no_figure("volume", reason);
    return;
  }
  const MeasuredValue value = enclosed_volume(mesh_);
  const MeasuredValue around = surface_area(mesh_);
  const double sigma = figure_sigma(value, unit_);
  const double unstated = (1 - value.stated) * figure_value(around, unit_);
  // Of shells that cut each other, none lies within another.
  const bool is_nested = c.passed() && c.components > 1;
  const size_t doubled = is_nested ? settled_shells(mesh_.mesh).dropped : size_t{0};
  Json more = {{"area_without_sigma", unstated},
               {"self_intersections", c.self_intersections},
               {"doubled_shells", doubled}};
  if (std::isfinite(sigma)) {
    more["interval"] = {figure_value(value, unit_) - 2 * sigma,
                        figure_value(value, unit_) + 2 * sigma};
  }
  // Nobody sees a volume: what can be observed of it is the surface around.
  more["surface_shares"] = surface_shares(around);
  figure_without_parts("volume", value, more);
  if (mesh_.states_provenance()) say("", "the surface around it: " + shares_text(around));
  say_overlaps(c.self_intersections, doubled);
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

void Measuring::say_overlaps(size_t self_intersections, size_t doubled_shells) const {
  const std::string helps = "; cgs filter --op watertight makes one solid of it";
  if (self_intersections > 0) {
    say("",
        "pairs of faces that cut or touch each other: " + std::to_string(self_intersections) +
            "; where the mesh overlaps itself, the volume counts twice" + helps);
  }
  if (doubled_shells > 0) {
    say("",
        "shells within others that look the same way: " + std::to_string(doubled_shells) +
            "; the volume counts what they enclose twice" + helps);
  }
}

void Measuring::bounds() {
  const OrientedBox box = oriented_box(mesh_);
  constexpr std::array<const char*, 3> kNames = {"length", "width", "height"};
  Json axes = Json::array();
  for (int k = 0; k < 3; ++k) {
    axes.push_back({box.axes(0, k), box.axes(1, k), box.axes(2, k)});
  }
  figures_["bounds"] = {{"center", point_json(box.center)}, {"axes", axes}};
  for (size_t k = 0; k < 3; ++k) {
    figures_["bounds"][kNames.at(k)] =
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

void Measuring::section(const std::string& plane,
                        const std::filesystem::path& svg,
                        const std::filesystem::path& dxf) {
  const CutPlane cutter = parse_plane(plane, mesh_);
  const Section cut = cgs::section(mesh_, cutter);
  if (cut.lines.empty()) {
    throw InvalidInput("--section " + plane +
                       " does not cut the mesh; it misses it, or only touches it");
  }
  figure("section_length", cut.length, {{"lines", cut.lines.size()}, {"open", cut.open_lines}});
  std::string area_text = figure_text(cut.area, unit_, false);
  if (cut.open_lines == 0) {
    figure_without_parts("section_area", cut.area, Json::object());
  } else {
    const std::string reason = "open lines: " + std::to_string(cut.open_lines) + " of " +
                               std::to_string(cut.lines.size()) + ", where the surface has gaps";
    no_figure("section_area", with_seams(reason, mesh_.mesh));
    area_text = "none: " + reason;
  }
  if (svg.empty() && dxf.empty()) return;
  Drawing drawing = section_drawing(cut, cutter, mesh_, unit_);
  drawing.title = printable(file_.filename()) + ", section " + plane;
  drawing.notes.insert(drawing.notes.begin(),
                       {"length " + figure_text(cut.length, unit_, mesh_.states_provenance()),
                        "enclosed area " + area_text});
  if (!svg.empty()) write_svg(svg, drawing);
  if (!dxf.empty()) write_dxf(dxf, drawing);
}

void Measuring::fit(const std::string& shape, const std::string& at, const std::string& radius) {
  const Shape wanted = shape == "plane"    ? Shape::Plane
                       : shape == "sphere" ? Shape::Sphere
                                           : Shape::Cylinder;
  const SurfacePoint middle = pick(at);
  const ShapeFit fit =
      fit_shape(mesh_, wanted, middle.position, parse_length(radius, mesh_.frame, "--radius"));
  const auto length = [&](double value) { return value * unit_.length; };
  const Json picked = picked_json(at, middle);
  Json out = {{"shape", shape},
              {"at", picked},
              {"point", point_json(fit.point)},
              {"point_sigma", length(fit.point_sigma)},
              {"rms", length(fit.rms)},
              {"max", length(fit.largest)},
              {"unit", unit_.name},
              {"vertices", fit.vertices},
              {"area", figure_json(fit.area, unit_, mesh_.states_provenance())}};
  if (wanted != Shape::Sphere) {
    out["direction"] = {fit.direction.x(), fit.direction.y(), fit.direction.z()};
    out["direction_sigma_degrees"] = fit.direction_sigma * 180 / M_PI;
  }
  if (wanted != Shape::Plane) {
    out["radius"] = figure_json(fit.radius, unit_, mesh_.states_provenance());
    out["radius"]["scatter"] = length(fit.radius_scatter);
    say("radius", figure_text(fit.radius, unit_, mesh_.states_provenance()));
  }
  say("fit", fit_text(fit, shape, mesh_.file_from_internal(fit.point), unit_));
  if (fit.area.stated == 0) say("", scatter_text(fit, unit_));
  say("",
      "--at lies " + number(picked["moved"].get<double>(), "%.3g") + " " + unit_.name +
          " off the surface");
  figures_["fit"] = std::move(out);
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
  figures_["orthophoto"] = out;
}

// Inside out, gaps between parts would be taken for their thickness; of an open mesh, whatever lies
// behind a sheet.
void Measuring::require_inside(const char* option) {
  if (!certified().closed) {
    throw InvalidInput(with_seams(
        std::string(option) + " needs to know what is inside, but this mesh is not closed; take "
                              "the watertight.ply of a "
                              "run, or close it by cgs filter --op fill-holes or --op watertight",
        mesh_.mesh));
  }
  if (certified().oriented_outward) return;
  throw InvalidInput(std::string(option) +
                     " needs to know what is inside, but faces of this closed mesh disagree on it "
                     "or all look inward; cgs filter --op repair turns them");
}

void Measuring::thickness() {
  require_inside("--thickness");
  constexpr size_t kSamples = 20'000;
  const ThicknessSummary summary = summarize_thickness(mesh_, surface(), kSamples);
  figures_["thickness"] = thickness_json(summary, unit_);
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
  figures_["thickness_at"] = std::move(all);
}

void Measuring::thickness_ply(const std::filesystem::path& path) {
  require_inside("--thickness-ply");
  write_thickness_ply(path, mesh_, thickness_of_vertices(mesh_, surface()));
}

void Measuring::certificate() {
  figures_["certificate"] = certificate_to_json(certified(), mesh_.mesh, mesh_.frame);
  say("certificate", certificate_line(certified()));
}

}  // namespace cgs
