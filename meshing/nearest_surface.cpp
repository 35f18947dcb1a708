// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/nearest_surface.h"

#include <algorithm>
#include <cmath>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <Eigen/Geometry>
#include <tbb/parallel_sort.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// The side of a face from its k-th corner to the next one, without direction.
struct Edge {
  uint32_t low;
  uint32_t high;
  uint32_t face;
  bool operator<(const Edge& other) const {
    return std::tie(low, high, face) < std::tie(other.low, other.high, other.face);
  }
};

Eigen::Vector3d face_normal(const MeasurableMesh& mesh, uint32_t face) {
  const auto& f = mesh.mesh.faces[face];
  const Eigen::Vector3d& a = mesh.points[f[0]];
  return (mesh.points[f[1]] - a).cross(mesh.points[f[2]] - a).stableNormalized();
}

}  // namespace

Eigen::Vector3d nearest_weights(const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c,
                                const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

struct NearestSurface::Parts {
  explicit Parts(const MeasurableMesh& m) : mesh(m) {}

  const MeasurableMesh& mesh;
  Triangles triangles;
  std::vector<uint32_t> face_of;  // per triangle
  Tree tree;
  std::vector<Eigen::Vector3d> vertex_normals;  // angle-weighted
  std::vector<Edge> edges;                      // sorted

  void add_triangles();
  void add_pseudonormals();
  Eigen::Vector3d edge_normal(uint32_t a, uint32_t b) const;
  SurfacePoint on_triangle(Triangles::const_iterator triangle, const Eigen::Vector3d& point) const;
};

void NearestSurface::Parts::add_triangles() {
  for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const auto& face = mesh.mesh.faces[f];
    const Kernel::Triangle_3 t(to_cgal(mesh.points[face[0]]),
                               to_cgal(mesh.points[face[1]]),
                               to_cgal(mesh.points[face[2]]));
    if (t.is_degenerate()) continue;
    triangles.push_back(t);
    face_of.push_back(f);
  }
}

void NearestSurface::Parts::add_pseudonormals() {
  vertex_normals.assign(mesh.points.size(), Eigen::Vector3d::Zero());
  edges.reserve(3 * face_of.size());
  for (const uint32_t f : face_of) {
    const auto& face = mesh.mesh.faces[f];
    const Eigen::Vector3d normal = face_normal(mesh, f);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = face.at(k);
      const uint32_t next = face.at((k + 1) % 3);
      const Eigen::Vector3d u = (mesh.points[next] - mesh.points[v]).stableNormalized();
      const Eigen::Vector3d w =
          (mesh.points[face.at((k + 2) % 3)] - mesh.points[v]).stableNormalized();
      vertex_normals[v] += std::atan2(u.cross(w).norm(), u.dot(w)) * normal;
      edges.push_back({std::min(v, next), std::max(v, next), f});
    }
  }
  tbb::parallel_sort(edges.begin(), edges.end());
}

Eigen::Vector3d NearestSurface::Parts::edge_normal(uint32_t a, uint32_t b) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Edge first{std::min(a, b), std::max(a, b), 0};
  for (auto it = std::lower_bound(edges.begin(), edges.end(), first);
       it != edges.end() && it->low == first.low && it->high == first.high;
       ++it) {
    sum += face_normal(mesh, it->face);
  }
  return sum;
}

NearestSurface::NearestSurface(const MeasurableMesh& mesh) : parts_(std::make_unique<Parts>(mesh)) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  parts_->add_triangles();
  require(!parts_->triangles.empty(),
          "a distance needs a surface with faces of positive area, their number",
          mesh.mesh.faces.size());
  parts_->add_pseudonormals();
  parts_->tree.insert(parts_->triangles.cbegin(), parts_->triangles.cend());
  parts_->tree.build();
  parts_->tree.accelerate_distance_queries();
}

NearestSurface::~NearestSurface() = default;

SurfacePoint NearestSurface::Parts::on_triangle(Triangles::const_iterator triangle,
                                                const Eigen::Vector3d& point) const {
  SurfacePoint out;
  out.face = face_of[static_cast<size_t>(triangle - triangles.cbegin())];
  const auto& f = mesh.mesh.faces[out.face];
  const Eigen::Vector3d& a = mesh.points[f[0]];
  const Eigen::Vector3d& b = mesh.points[f[1]];
  const Eigen::Vector3d& c = mesh.points[f[2]];
  out.weights = nearest_weights(a, b, c, point);
  out.position = out.weights[0] * a + out.weights[1] * b + out.weights[2] * c;
  return out;
}

SurfacePoint NearestSurface::nearest(const Eigen::Vector3d& point) const {
  const auto found = parts_->tree.closest_point_and_primitive(to_cgal(point));
  return parts_->on_triangle(found.second, point);
}

std::optional<SurfacePoint> NearestSurface::nearest_within(const Eigen::Vector3d& point,
                                                           double distance) const {
  // The tree looks for what is nearer than a hint, which need not lie on the surface.
  const Kernel::Point_3 hint = to_cgal(point + Eigen::Vector3d(distance, 0, 0));
  const auto found =
      parts_->tree.closest_point_and_primitive(to_cgal(point), {hint, parts_->triangles.cbegin()});
  if (found.first == hint) return std::nullopt;
  return parts_->on_triangle(found.second, point);
}

double NearestSurface::signed_distance(const Eigen::Vector3d& point,
                                       const SurfacePoint& nearest) const {
  const auto& f = parts_->mesh.mesh.faces[nearest.face];
  const Eigen::Vector3d offset = point - nearest.position;
  Eigen::Vector3d normal = face_normal(parts_->mesh, nearest.face);
  const auto zeros = (nearest.weights.array() == 0).count();
  if (zeros == 2) {
    Eigen::Index corner = 0;
    nearest.weights.maxCoeff(&corner);
    normal = parts_->vertex_normals[f.at(static_cast<size_t>(corner))];
  } else if (zeros == 1) {
    Eigen::Index opposite = 0;
    nearest.weights.minCoeff(&opposite);
    normal = parts_->edge_normal(f.at(static_cast<size_t>((opposite + 1) % 3)),
                                 f.at(static_cast<size_t>((opposite + 2) % 3)));
  }
  return offset.dot(normal) < 0 ? -offset.norm() : offset.norm();
}

SurfaceEvidence evidence_at(const MeasurableMesh& mesh, const SurfacePoint& point) {
  SurfaceEvidence out;
  out.normal = face_normal(mesh, point.face);
  const auto& f = mesh.mesh.faces[point.face];
  if (mesh.states_provenance()) out.provenance = mesh.mesh.provenance[point.face];
  out.sigma = std::numeric_limits<double>::quiet_NaN();
  // Invented surface between observed corners is no better known for their sigma.
  const bool invented = mesh.states_provenance() && out.provenance == Provenance::Inferred;
  if (mesh.states_sigma() && !invented) {
    out.sigma = 0;
    for (size_t k = 0; k < 3; ++k) {
      const double weight = point.weights[static_cast<Eigen::Index>(k)];
      if (weight > 0) out.sigma += weight * double(mesh.mesh.sigma[f.at(k)]);
    }
  }
  return out;
}

}  // namespace cgs
