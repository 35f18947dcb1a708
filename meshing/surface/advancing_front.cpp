// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/advancing_front.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include <CGAL/Advancing_front_surface_reconstruction.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/measured_value.h"
#include "meshing/mesh/nudged_point.h"
#include "meshing/mesh/places.h"
#include "meshing/mesh/polygon_mesh.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

using polygon_mesh::Point;

/// Prefers small triangles, as CGAL does by default, but takes none with a longer edge.
struct SmallAndShort {
  const std::vector<Eigen::Vector3f>* points = nullptr;
  double max_edge = 0;

  template <typename Front, typename Cell>
  double operator()(const Front& front, const Cell& cell, int opposite) const {
    std::array<Eigen::Vector3f, 3> corner;
    for (size_t k = 0; k < 3; ++k) {
      corner.at(k) = (*points)[cell->vertex((opposite + int(k) + 1) % 4)->id()];
    }
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f edge = corner.at((k + 1) % 3) - corner.at(k);
      if (double{edge.norm()} > max_edge) return front.infinity();
    }
    return front.smallest_radius_delaunay_sphere(cell, opposite);
  }
};

// The first point of every place, in their order.
std::vector<uint32_t> distinct(const std::vector<Eigen::Vector3f>& points) {
  const std::vector<uint32_t> first = first_at_place(points);
  std::vector<uint32_t> out;
  for (uint32_t v = 0; v < first.size(); ++v) {
    if (first[v] == v) out.push_back(v);
  }
  return out;
}

bool on_a_line(const std::vector<Eigen::Vector3f>& points) {
  const Eigen::Vector3f& a = points.front();
  const auto& b =
      *std::max_element(points.begin(), points.end(), [&](const auto& p, const auto& q) {
        return (p - a).squaredNorm() < (q - a).squaredNorm();
      });
  return std::all_of(points.begin(), points.end(), [&](const Eigen::Vector3f& p) {
    return CGAL::collinear(
        polygon_mesh::point_of(a), polygon_mesh::point_of(b), polygon_mesh::point_of(p));
  });
}

// \pre no two points are in one place
std::vector<std::array<uint32_t, 3>> joined_points(const std::vector<Eigen::Vector3f>& points,
                                                   double spacing,
                                                   double max_edge) {
  if (on_a_line(points)) return {};  // CGAL would make triangles of what it is nudged to
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  constexpr double kTiny = 1e-4;
  std::vector<Point> places;
  places.reserve(points.size());
  for (size_t v = 0; v < points.size(); ++v) {
    const Eigen::Vector3d p = nudged_point(points[v], v, kTiny * spacing);
    places.emplace_back(p.x(), p.y(), p.z());
  }
  std::vector<std::array<size_t, 3>> found;
  try {
    CGAL::advancing_front_surface_reconstruction(
        places.begin(), places.end(), std::back_inserter(found), SmallAndShort{&points, max_edge});
  } catch (const CGAL::Failure_exception&) {
    found.clear();
  }
  std::vector<std::array<uint32_t, 3>> out;
  out.reserve(found.size());
  for (const auto& [a, b, c] : found) out.push_back({uint32_t(a), uint32_t(b), uint32_t(c)});
  return out;
}

// Where faces of a part should look at a corner: along its normal, or away from the middle.
std::vector<Eigen::Vector3d> outward(const TriangleMesh& mesh, const MeshComponents& parts) {
  std::vector<Eigen::Vector4d> middle(parts.area.size(), Eigen::Vector4d::Zero());
  std::vector<uint8_t> states_normals(parts.area.size(), 0);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const uint32_t v : mesh.faces[f]) {
      middle[parts.of_face[f]] += mesh.vertices[v].cast<double>().homogeneous();
      if (!mesh.normals.empty() && !mesh.normals[v].isZero(0)) states_normals[parts.of_face[f]] = 1;
    }
  }
  std::vector<Eigen::Vector3d> out(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const Eigen::Vector3d center = middle[parts.of_face[f]].hnormalized();
    for (const uint32_t v : mesh.faces[f]) {
      out[v] = states_normals[parts.of_face[f]] != 0
                   ? mesh.normals[v].cast<double>()
                   : Eigen::Vector3d(mesh.vertices[v].cast<double>() - center);
    }
  }
  return out;
}

/// How the faces of a part lie, sums over them.
struct PartSide {
  double agreement = 0;  // with where they should look
  double most = 0;       // that it could be
  Eigen::Vector3d area = Eigen::Vector3d::Zero();

  // Where that says nothing, as of a plane without normals, the larger side of an axis is out.
  bool is_wrong() const {
    constexpr double kNoise = 1e-4;
    if (std::abs(agreement) > kNoise * most) return agreement < 0;
    Eigen::Index axis = 0;
    area.cwiseAbs().maxCoeff(&axis);
    return area[axis] < 0;
  }
};

// Neighbours agree within a part already.
void turn_parts(TriangleMesh& mesh) {
  const MeshComponents parts = components(mesh);
  const std::vector<Eigen::Vector3d> sides = outward(mesh, parts);
  std::vector<PartSide> all(parts.area.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    const Eigen::Vector3d area = area_vector(mesh, mesh.faces[f]);
    const Eigen::Vector3d out = sides[a] + sides[b] + sides[c];
    PartSide& part = all[parts.of_face[f]];
    part.agreement += area.dot(out);
    part.most += area.norm() * out.norm();
    part.area += area;
  }
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (all[parts.of_face[f]].is_wrong()) std::swap(mesh.faces[f][1], mesh.faces[f][2]);
  }
}

// Order and first corners, which CGAL takes from addresses in memory, from the triangles alone.
void sort_faces(TriangleMesh& mesh) {
  for (auto& f : mesh.faces) {
    std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
  }
  std::sort(mesh.faces.begin(), mesh.faces.end());
}

// A face rests on all its corners, also where other points are nearer to most of it.
void weaken_by_corners(TriangleMesh& mesh, const StatedSurface& source) {
  if (mesh.provenance.empty()) return;
  std::vector<Provenance> label;
  label.reserve(mesh.vertices.size());
  for (const auto& p : mesh.vertices) label.push_back(source.nearest(p.cast<double>()).label);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const uint32_t v : mesh.faces[f]) {
      mesh.provenance[f] = weaker_evidence(mesh.provenance[f], label[v]);
    }
  }
}

}  // namespace

InterpolatedSurface advancing_front(const TriangleMesh& cloud, double max_edge) {
  require(cloud.faces.empty(),
          "joining points needs a point cloud: the number of faces must be 0",
          cloud.faces.size());
  require(cloud.vertices.size() >= 3,
          "the number of points of a surface must be >= 3",
          cloud.vertices.size());
  require(max_edge > 0, "the longest edge must be > 0", max_edge);
  InterpolatedSurface out;
  std::vector<uint8_t> keep(cloud.vertices.size(), 0);
  for (const uint32_t v : distinct(cloud.vertices)) keep[v] = 1;
  out.mesh = with_vertices(cloud, keep);
  const double spacing = point_spacing(out.mesh.vertices);
  out.mesh.faces = joined_points(out.mesh.vertices, spacing, max_edge);
  if (out.mesh.faces.empty()) throw NumericalError("no three of the points could be joined");
  out.mesh = without_unused_vertices(out.mesh);
  out.unused = cloud.vertices.size() - out.mesh.vertices.size();
  turn_parts(out.mesh);
  sort_faces(out.mesh);
  const StatedSurface source(cloud);
  out.evidence = take_labels(out.mesh, source, 2 * spacing);
  weaken_by_corners(out.mesh, source);
  return out;
}

}  // namespace cgs
