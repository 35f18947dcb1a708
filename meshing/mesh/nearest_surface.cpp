// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/nearest_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>
#include <utility>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <Eigen/Geometry>
#include <tbb/parallel_sort.h>

#include "libcgs/core/angle_between.h"
#include "libcgs/core/error.h"
#include "meshing/mesh/places.h"
#include "meshing/mesh/triangle_tree.h"

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 to_cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// A side of a face, without direction, between places.
struct Edge {
  uint32_t low;
  uint32_t high;
  uint32_t face;
  bool operator<(const Edge& other) const {
    return std::tie(low, high, face) < std::tie(other.low, other.high, other.face);
  }
};

// One end of an edge that one face has alone.
struct RimEnd {
  uint32_t vertex;
  uint32_t other;          // the other end
  Eigen::Vector3d beyond;  // out of the face, in its plane; unit length, 0 if it has no area
};

// Where on a face a place lies: at the corner `a`, on the side from `a` to `b`, or within.
struct Feature {
  int corners = 3;
  uint32_t a = 0;
  uint32_t b = 0;
};

// Sorted. Faces with two corners in one place have none: those beside them meet.
std::vector<Edge> edges_of(const MeasurableMesh& mesh, const std::vector<uint32_t>& place) {
  std::vector<Edge> out;
  out.reserve(3 * mesh.mesh.faces.size());
  for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const auto& face = mesh.mesh.faces[f];
    const std::array<uint32_t, 3> at = {place[face[0]], place[face[1]], place[face[2]]};
    if (at[0] == at[1] || at[1] == at[2] || at[2] == at[0]) continue;
    for (size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(at.at(k), at.at((k + 1) % 3));
      out.push_back({low, high, f});
    }
  }
  tbb::parallel_sort(out.begin(), out.end());
  return out;
}

// Those of sorted edges that one face has alone.
std::vector<Edge> lone_edges(const std::vector<Edge>& edges) {
  const auto is_same = [](const Edge& e, const Edge& f) {
    return e.low == f.low && e.high == f.high;
  };
  std::vector<Edge> out;
  for (size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && is_same(edges[i - 1], edges[i])) continue;
    if (i + 1 < edges.size() && is_same(edges[i], edges[i + 1])) continue;
    out.push_back(edges[i]);
  }
  return out;
}

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
  std::vector<uint32_t> face_of;  // per triangle, ascending
  TriangleTree tree;
  std::vector<uint32_t> place;                  // per vertex
  std::vector<Eigen::Vector3d> vertex_normals;  // per place; angle-weighted
  std::vector<Edge> edges;                      // sorted
  std::vector<RimEnd> rim;                      // sorted
  double rounding = 0;                          // of coordinates as floats [internal units]

  void add_pseudonormals();
  void add_rim();
  Eigen::Vector3d out_of_face(const Edge& edge) const;
  Feature feature(const SurfacePoint& nearest) const;
  Eigen::Vector3d edge_normal(uint32_t a, uint32_t b) const;
  std::span<const RimEnd> rim_at(const SurfacePoint& nearest) const;
  bool is_proper(uint32_t face) const {
    return std::binary_search(face_of.begin(), face_of.end(), face);
  }
};

void NearestSurface::Parts::add_pseudonormals() {
  place = first_at_place(mesh.points);
  edges = edges_of(mesh, place);
  vertex_normals.assign(mesh.points.size(), Eigen::Vector3d::Zero());
  for (const uint32_t f : face_of) {
    const auto& face = mesh.mesh.faces[f];
    const Eigen::Vector3d normal = face_normal(mesh, f);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = face.at(k);
      const Eigen::Vector3d u =
          (mesh.points[face.at((k + 1) % 3)] - mesh.points[v]).stableNormalized();
      const Eigen::Vector3d w =
          (mesh.points[face.at((k + 2) % 3)] - mesh.points[v]).stableNormalized();
      vertex_normals[place[v]] += angle_between(u, w) * normal;
    }
  }
}

void NearestSurface::Parts::add_rim() {
  for (const Edge& edge : lone_edges(edges)) {
    const Eigen::Vector3d beyond = out_of_face(edge);
    rim.push_back({edge.low, edge.high, beyond});
    rim.push_back({edge.high, edge.low, beyond});
  }
  std::sort(rim.begin(), rim.end(), [](const RimEnd& a, const RimEnd& b) {
    return std::tie(a.vertex, a.other) < std::tie(b.vertex, b.other);
  });
  double farthest = 0;
  for (const RimEnd& end : rim) {
    farthest = std::max(farthest, mesh.points[end.vertex].cwiseAbs().maxCoeff());
  }
  rounding = 4 * double(std::numeric_limits<float>::epsilon()) * farthest;
}

// In the plane of its face, at a right angle to the edge.
Eigen::Vector3d NearestSurface::Parts::out_of_face(const Edge& edge) const {
  if (!is_proper(edge.face)) return Eigen::Vector3d::Zero();
  const auto& face = mesh.mesh.faces[edge.face];
  const uint32_t opposite = *std::find_if(face.begin(), face.end(), [&](uint32_t v) {
    return place[v] != edge.low && place[v] != edge.high;
  });
  const Eigen::Vector3d along = (mesh.points[edge.high] - mesh.points[edge.low]).stableNormalized();
  const Eigen::Vector3d out = mesh.points[edge.low] - mesh.points[opposite];
  return (out - out.dot(along) * along).stableNormalized();
}

Feature NearestSurface::Parts::feature(const SurfacePoint& nearest) const {
  const auto& f = mesh.mesh.faces[nearest.face];
  const auto at = [&](Eigen::Index k) { return place[f.at(static_cast<size_t>(k % 3))]; };
  const auto zeros = (nearest.weights.array() == 0).count();
  Eigen::Index k = 0;
  if (zeros == 2) {
    nearest.weights.maxCoeff(&k);
    return {1, at(k), at(k)};
  }
  if (zeros == 1) {
    nearest.weights.minCoeff(&k);
    return {2, at(k + 1), at(k + 2)};
  }
  return {};
}

Eigen::Vector3d NearestSurface::Parts::edge_normal(uint32_t a, uint32_t b) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Edge first{std::min(a, b), std::max(a, b), 0};
  for (auto it = std::lower_bound(edges.begin(), edges.end(), first);
       it != edges.end() && it->low == first.low && it->high == first.high;
       ++it) {
    if (is_proper(it->face)) sum += face_normal(mesh, it->face);
  }
  return sum;
}

// The ends of rim edges at a vertex, or the one end of an edge; none where it is not on the rim.
std::span<const RimEnd> NearestSurface::Parts::rim_at(const SurfacePoint& nearest) const {
  const Feature on = feature(nearest);
  if (on.corners == 3) return {};
  const auto from = [&](uint64_t vertex, uint64_t other) {
    return std::partition_point(rim.begin(), rim.end(), [&](const RimEnd& end) {
      return end.vertex < vertex || (end.vertex == vertex && end.other < other);
    });
  };
  if (on.corners == 1) return {from(on.a, 0), from(uint64_t{on.a} + 1, 0)};
  return {from(on.a, on.b), from(on.a, uint64_t{on.b} + 1)};
}

NearestSurface::NearestSurface(const MeasurableMesh& mesh) : parts_(std::make_unique<Parts>(mesh)) {
  require(!parts_->face_of.empty(),
          "a distance needs a surface with faces of positive area, their number",
          mesh.mesh.faces.size());
  parts_->add_pseudonormals();
  parts_->add_rim();
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
  const Eigen::Vector3d offset = point - nearest.position;
  const Feature on = parts_->feature(nearest);
  const Eigen::Vector3d normal = on.corners == 1   ? parts_->vertex_normals[on.a]
                                 : on.corners == 2 ? parts_->edge_normal(on.a, on.b)
                                                   : face_normal(parts_->mesh, nearest.face);
  return offset.dot(normal) < 0 ? -offset.norm() : offset.norm();
}

bool NearestSurface::is_on_rim(const SurfacePoint& nearest) const {
  return !parts_->rim_at(nearest).empty();
}

bool NearestSurface::is_beyond_rim(const Eigen::Vector3d& point,
                                   const SurfacePoint& nearest) const {
  constexpr double kAside = 1e-6;  // of the distance
  const Eigen::Vector3d offset = point - nearest.position;
  const double least = std::max(kAside * offset.norm(), parts_->rounding);
  const std::span<const RimEnd> rim = parts_->rim_at(nearest);
  return std::any_of(
      rim.begin(), rim.end(), [&](const RimEnd& end) { return offset.dot(end.beyond) > least; });
}

SurfaceEvidence evidence_at(const MeasurableMesh& mesh, const SurfacePoint& point) {
  SurfaceEvidence out;
  out.normal = face_normal(mesh, point.face);
  const auto& f = mesh.mesh.faces[point.face];
  if (mesh.states_provenance()) out.provenance = mesh.mesh.provenance[point.face];
  out.sigma = std::numeric_limits<double>::quiet_NaN();
  // Invented surface between observed corners is no better known for their sigma.
  const bool invented = mesh.states_provenance() && !has_evidence(out.provenance);
  if (!mesh.mesh.sigma.empty() && !invented) {
    out.sigma = 0;
    for (size_t k = 0; k < 3; ++k) {
      const double weight = point.weights[static_cast<Eigen::Index>(k)];
      if (weight > 0) out.sigma += weight * double(mesh.mesh.sigma[f.at(k)]);
    }
  }
  return out;
}

bool has_rim(const MeasurableMesh& mesh) {
  return !lone_edges(edges_of(mesh, first_at_place(mesh.points))).empty();
}

}  // namespace cgs
