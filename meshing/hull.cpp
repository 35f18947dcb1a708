// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/hull.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>
#include <vector>

#include <CGAL/convex_hull_3.h>

#include "libcgs/core/error.h"
#include "meshing/components.h"
#include "meshing/polygon_mesh.h"

namespace cgs {

namespace {

using Face = std::array<uint32_t, 3>;

// From the smallest corner on, so that equal faces are equal.
Face rotated(Face face) {
  std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  return face;
}

}  // namespace

TriangleMesh convex_hull(const TriangleMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  std::vector<polygon_mesh::Point> points;
  std::map<std::tuple<double, double, double>, uint32_t> number;
  for (uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto& p = points.emplace_back(polygon_mesh::point_of(mesh.vertices[v]));
    number.try_emplace({p.x(), p.y(), p.z()}, v);
  }
  polygon_mesh::PolygonMesh hull;
  if (points.size() >= 4) CGAL::convex_hull_3(points.begin(), points.end(), hull);
  if (hull.number_of_faces() < 4)
    throw NumericalError("a convex hull needs points not in one plane");
  std::map<Face, Provenance> labels;
  for (size_t f = 0; f < mesh.provenance.size(); ++f) {
    labels.try_emplace(rotated(mesh.faces[f]), mesh.provenance[f]);
  }
  TriangleMesh out = mesh;
  out.faces.clear();
  out.provenance.clear();
  for (const auto f : hull.faces()) {
    Face face{};
    size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(hull.halfedge(f), hull)) {
      const auto& p = hull.point(v);
      face.at(k++) = number.at({p.x(), p.y(), p.z()});
    }
    const auto known = labels.find(rotated(face));
    out.faces.push_back(face);
    out.provenance.push_back(known == labels.end() ? Provenance::Inferred : known->second);
  }
  out = with_faces(out, std::vector<uint8_t>(out.faces.size(), 1));
  if (!mesh.normals.empty()) out.normals = vertex_normals(out);
  return out;
}

}  // namespace cgs
