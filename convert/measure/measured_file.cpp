// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/measured_file.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>

#include <nlohmann/json.hpp>

#include "convert/splats/splat_files.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/byte_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

double finite_number(const std::string& text, const std::string& whole) {
  double value = 0;
  if (!parse_number(text, value) || !std::isfinite(value)) {
    throw InvalidInput("'" + whole + "': '" + text + "' is not a number");
  }
  return value;
}

std::string vector_text(const Eigen::Vector3d& v) {
  std::ostringstream out;
  out.precision(9);
  out << v.x() << ", " << v.y() << ", " << v.z();
  return out.str();
}

}  // namespace

MeasurableFile read_measured(const std::filesystem::path& path,
                             const std::string& assume_unit,
                             const std::optional<Frame>& frame) {
  if (is_splat_file(path)) {
    throw InvalidInput(printable(path) +
                       " holds splats, not a mesh or points; cgs convert makes a mesh of them");
  }
  MeasurableFile out = read_mesh_file(path, frame);
  if (assume_unit.empty()) return out;
  const std::string refused = cgs::assume_unit(out.content.frame, assume_unit);
  if (!refused.empty()) out.warnings.push_back(refused);
  return out;
}

nlohmann::ordered_json measured_json(const std::filesystem::path& path,
                                     const MeasurableMesh& mesh,
                                     const FigureUnit& unit) {
  return {{"file", printable(path)},
          {"vertices", mesh.points.size()},
          {"faces", mesh.mesh.faces.size()},
          {"unit", unit.name},
          {"scale",
           {{"source", scale_source_name(mesh.frame.scale_source)},
            {"metres_per_unit", mesh.frame.metres_per_unit},
            {"relative_sigma", unit.relative_sigma}}},
          {"provenance", mesh.states_provenance() ? "stated" : "not stated"},
          {"sigma", mesh.states_sigma() ? "stated" : "not stated"}};
}

std::string measured_line(const std::filesystem::path& path,
                          const MeasurableMesh& mesh,
                          const FigureUnit& unit) {
  std::string out = printable(path) + ": " + std::to_string(mesh.points.size()) + " vertices, " +
                    std::to_string(mesh.mesh.faces.size()) + " faces; figures in " + unit.name;
  if (unit.relative_sigma > 0) {
    std::ostringstream percent;
    percent << ", scale ± " << 100 * unit.relative_sigma << " %";
    out += percent.str();
  }
  if (!mesh.states_provenance()) out += "; the file does not say what was observed";
  return out;
}

std::string certificate_line(const Certificate& c) {
  std::string out = c.closed ? "closed" : "open";
  out += c.edge_manifold && c.vertex_manifold ? ", manifold" : ", NOT manifold";
  if (c.closed) out += c.oriented_outward ? ", oriented outward" : ", NOT oriented outward";
  out += c.self_intersections == 0
             ? ", no self-intersection"
             : ", " + std::to_string(c.self_intersections) + " self-intersecting pairs of faces";
  out += ", " + std::to_string(c.components) + (c.components == 1 ? " component" : " components");
  if (c.closed && c.edge_manifold) out += ", genus " + std::to_string(c.genus);
  return out;
}

Eigen::Vector3d parse_point(const std::string& text) {
  std::istringstream parts(text);
  std::string part;
  std::vector<double> numbers;
  while (std::getline(parts, part, ',')) numbers.push_back(finite_number(part, text));
  if (numbers.size() != 3) {
    throw InvalidInput("'" + text + "' is not a point; write x,y,z without blanks");
  }
  return {numbers[0], numbers[1], numbers[2]};
}

CutPlane parse_plane(const std::string& text, const MeasurableMesh& mesh) {
  if (const size_t slash = text.find('/'); slash != std::string::npos) {
    return cut_plane(mesh.internal_from_file(parse_point(text.substr(0, slash))),
                     parse_point(text.substr(slash + 1)));
  }
  if (text.size() < 3 || text[0] < 'x' || text[0] > 'z' || text[1] != '=') {
    throw InvalidInput("'" + text + "' is not a plane; write z=1.5 or x,y,z/nx,ny,nz");
  }
  const int axis = text[0] - 'x';
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  point[axis] = finite_number(text.substr(2), text);
  normal[axis] = 1;
  CutPlane out = cut_plane(mesh.internal_from_file(point), normal);
  // Near the mesh, so that numbers on the way stay small; the drawing is moved back.
  for (int k = 0; k < 3; ++k) {
    if (k != axis) out.point[k] = 0;
  }
  return out;
}

Drawing section_drawing(const Section& section,
                        const CutPlane& plane,
                        const MeasurableMesh& mesh,
                        const FigureUnit& unit) {
  Drawing out;
  out.unit = mesh.frame.has_metric_scale() ? unit.name : "unknown";
  const double per_file_unit = unit.length / mesh.frame.scale;
  const Eigen::Vector3d point = mesh.file_from_internal(plane.point);
  const bool across_axis = plane.normal.cwiseAbs().maxCoeff() == 1;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  if (across_axis) shift = Eigen::Vector2d(plane.right.dot(point), plane.up.dot(point));
  for (const DrawnLine& line : section.lines) {
    out.lines.push_back(line);
    for (Eigen::Vector2d& p : out.lines.back().points) {
      p = (p * mesh.frame.scale + shift) * per_file_unit;
    }
  }
  out.notes.push_back(across_axis ? "x and y are coordinates of the file, in " + unit.name
                                  : "(0, 0) is (" + vector_text(point) + ") of the file");
  out.notes.push_back("x along (" + vector_text(plane.right) + "), y along (" +
                      vector_text(plane.up) + ")");
  return out;
}

}  // namespace cgs
