// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/nearest_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <Eigen/Geometry>
#include <tbb/parallel_sort.h>

#include "libcgs/core/angle_between.h"
#include "libcgs/core/error.h"
#include "meshing/triangle_tree.h"

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

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

// The faces of a mesh that have an area; the tree numbers them.
std::vector<uint32_t> proper_faces(const MeasurableMesh& mesh) {
  std::vector<uint32_t> out;
  for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const auto& face = mesh.mesh.faces[f];
    const bool is_line = CGAL::collinear(to_cgal(mesh.points[face[0]]),
                                         to_cgal(mesh.points[face[1]]),
                                         to_cgal(mesh.points[face[2]]));
    if (!is_line) out.push_back(f);
  }
  return out;
}

std::vector<TriangleTree::Triangle> triangles_of(const MeasurableMesh& mesh,
                                                 const std::vector<uint32_t>& faces) {
  std::vector<TriangleTree::Triangle> out;
  out.reserve(faces.size());
  for (const uint32_t f : faces) {
    const auto& face = mesh.mesh.faces[f];
    out.push_back({mesh.points[face[0]], mesh.points[face[1]], mesh.points[face[2]]});
  }
  return out;
}

}  // namespace

struct NearestSurface::Parts {
  explicit Parts(const MeasurableMesh& m)
      : mesh(m), face_of(proper_faces(m)), tree(triangles_of(m, face_of)) {}

  const MeasurableMesh& mesh;
  std::vector<uint32_t> face_of;  // per triangle
  TriangleTree tree;
  std::vector<Eigen::Vector3d> vertex_normals;  // angle-weighted
  std::vector<Edge> edges;                      // sorted

  void add_pseudonormals();
  Eigen::Vector3d edge_normal(uint32_t a, uint32_t b) const;
};

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
      vertex_normals[v] += angle_between(u, w) * normal;
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
  require(!parts_->face_of.empty(),
          "a distance needs a surface with faces of positive area, their number",
          mesh.mesh.faces.size());
  parts_->add_pseudonormals();
}

NearestSurface::~NearestSurface() = default;

SurfacePoint NearestSurface::nearest(const Eigen::Vector3d& point) const {
  return *nearest_within(point, std::numeric_limits<double>::infinity());
}

std::optional<SurfacePoint> NearestSurface::nearest_within(const Eigen::Vector3d& point,
                                                           double distance) const {
  const auto found = parts_->tree.nearest(point, distance);
  if (!found) return std::nullopt;
  SurfacePoint out;
  out.face = parts_->face_of[found->triangle];
  out.weights = found->weights;
  const auto& f = parts_->mesh.mesh.faces[out.face];
  for (size_t k = 0; k < 3; ++k) {
    out.position += out.weights[static_cast<Eigen::Index>(k)] * parts_->mesh.points[f.at(k)];
  }
  return out;
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
