// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/hull.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include <CGAL/convex_hull_3.h>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/error.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/polygon_mesh.h"

namespace cgs {

namespace {

using Face = std::array<uint32_t, 3>;

using polygon_mesh::Point;

// From the smallest corner on, so that equal faces are equal.
Face rotated(Face face) {
  std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  return face;
}

polygon_mesh::PolygonMesh hull_of(const std::vector<Point>& points) {
  polygon_mesh::PolygonMesh hull;
  if (points.size() >= 4) CGAL::convex_hull_3(points.begin(), points.end(), hull);
  if (hull.number_of_faces() < 4 || !CGAL::is_closed(hull)) {
    throw NumericalError("a convex hull needs points not in one plane");
  }
  return hull;
}

// The faces of the hull, in vertices of the input, in the order CGAL happens to have them.
std::vector<Face> hull_faces(const std::vector<Point>& points) {
  std::map<std::tuple<double, double, double>, uint32_t> number;
  for (uint32_t v = 0; v < points.size(); ++v) {
    number.try_emplace({points[v].x(), points[v].y(), points[v].z()}, v);
  }
  const polygon_mesh::PolygonMesh hull = hull_of(points);
  std::vector<Face> out;
  for (const auto f : hull.faces()) {
    Face face{};
    size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(hull.halfedge(f), hull)) {
      const Point& p = hull.point(v);
      face.at(k++) = number.at({p.x(), p.y(), p.z()});
    }
    out.push_back(face);
  }
  return out;
}

using Edge = std::pair<uint32_t, uint32_t>;

// The rim of a flat part of the hull, without corners that are none.
std::vector<uint32_t> outline(const std::map<uint32_t, uint32_t>& next,
                              const std::vector<Point>& points) {
  std::vector<uint32_t> rim = {next.begin()->first};
  while (next.at(rim.back()) != rim.front()) rim.push_back(next.at(rim.back()));
  std::vector<uint32_t> corners;
  for (size_t i = 0; i < rim.size(); ++i) {
    const uint32_t before = rim[(i + rim.size() - 1) % rim.size()];
    const uint32_t after = rim[(i + 1) % rim.size()];
    if (!CGAL::collinear(points[before], points[rim[i]], points[after])) corners.push_back(rim[i]);
  }
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

// A hull is unique but for the diagonals in its flat parts, which depend on addresses in memory:
// these are drawn again, from the first corner of every part.
std::vector<Face> unique_faces(const std::vector<Face>& faces, const std::vector<Point>& points) {
  std::map<Edge, uint32_t> face_at;
  for (uint32_t f = 0; f < faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) face_at[{faces[f][k], faces[f][(k + 1) % 3]}] = f;
  }
  DisjointSets parts(faces.size());
  for (const auto& entry : face_at) {
    const auto& edge = entry.first;  // not a binding: lambdas cannot capture one
    const auto& f = entry.second;
    const uint32_t g = face_at.at({edge.second, edge.first});
    const auto& tip = *std::find_if(faces[g].begin(), faces[g].end(), [&](uint32_t v) {
      return v != edge.first && v != edge.second;
    });
    const auto& [a, b, c] = faces[f];
    if (CGAL::coplanar(points[a], points[b], points[c], points[tip])) parts.join(f, g);
  }
  std::map<uint32_t, std::map<uint32_t, uint32_t>> rims;
  for (const auto& [edge, f] : face_at) {
    const uint32_t other = face_at.at({edge.second, edge.first});
    if (parts.root(other) != parts.root(f)) rims[parts.root(f)][edge.first] = edge.second;
  }
  std::vector<Face> out;
  for (const auto& [part, next] : rims) {
    const std::vector<uint32_t> corners = outline(next, points);
    for (size_t k = 2; k < corners.size(); ++k) {
      out.push_back({corners[0], corners[k - 1], corners[k]});
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

TriangleMesh convex_hull(const TriangleMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  std::vector<Point> points;
  points.reserve(mesh.vertices.size());
  for (const auto& p : mesh.vertices) points.push_back(polygon_mesh::point_of(p));
  const std::vector<Face> faces = unique_faces(hull_faces(points), points);
  std::map<Face, Provenance> labels;
  for (size_t f = 0; f < mesh.provenance.size(); ++f) {
    labels.try_emplace(rotated(mesh.faces[f]), mesh.provenance[f]);
  }
  TriangleMesh out = mesh;
  out.faces.clear();
  out.provenance.clear();
  for (const Face& face : faces) {
    const auto known = labels.find(rotated(face));
    out.faces.push_back(face);
    out.provenance.push_back(known == labels.end() ? Provenance::Inferred : known->second);
  }
  out = without_unused_vertices(out);
  if (!mesh.normals.empty()) out.normals = vertex_normals(out);
  return out;
}

std::vector<uint8_t> on_convex_hull(const std::vector<Eigen::Vector3d>& points) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  std::vector<Point> places;
  places.reserve(points.size());
  for (const auto& p : points) places.emplace_back(p.x(), p.y(), p.z());
  const polygon_mesh::PolygonMesh hull = hull_of(places);
  std::set<std::tuple<double, double, double>> corners;
  for (const auto v : hull.vertices()) {
    const Point& p = hull.point(v);
    corners.emplace(p.x(), p.y(), p.z());
  }
  std::vector<uint8_t> out;
  out.reserve(points.size());
  for (const auto& p : points) out.push_back(corners.count({p.x(), p.y(), p.z()}) != 0 ? 1 : 0);
  return out;
}

}  // namespace cgs
