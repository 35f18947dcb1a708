// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/crease_normals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "libcgs/core/disjoint_sets.h"

namespace cgs {

namespace {

// An edge as one face has it; corners are numbered three to a face.
struct FaceEdge {
  uint32_t low, high;
  uint32_t low_corner, high_corner;
  bool operator<(const FaceEdge& other) const {
    return std::tie(low, high, low_corner) < std::tie(other.low, other.high, other.low_corner);
  }
  bool is_edge_of(const FaceEdge& other) const { return low == other.low && high == other.high; }
};

std::vector<FaceEdge> edges_of_faces(const TriangleMesh& mesh) {
  std::vector<FaceEdge> out;
  out.reserve(mesh.faces.size() * 3);
  uint32_t corner = 0;
  for (const auto& face : mesh.faces) {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t next = (k + 1) % 3;
      FaceEdge e{face[k], face[next], corner + k, corner + next};
      if (e.low > e.high) {
        std::swap(e.low, e.high);
        std::swap(e.low_corner, e.high_corner);
      }
      out.push_back(e);
    }
    corner += 3;
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

ShadingVertices split_at_creases(const TriangleMesh& mesh, double largest_angle) {
  std::vector<Eigen::Vector3d> areas;
  for (const auto& face : mesh.faces) areas.push_back(area_vector(mesh, face));
  const double least = std::cos(largest_angle * std::numbers::pi / 180);
  const auto is_smooth = [&](uint32_t f, uint32_t g) {
    return areas[f].dot(areas[g]) >= least * areas[f].norm() * areas[g].norm();
  };
  const auto corners = static_cast<uint32_t>(mesh.faces.size() * 3);
  DisjointSets sides(corners);
  const std::vector<FaceEdge> edges = edges_of_faces(mesh);
  for (size_t i = 0; i < edges.size();) {
    size_t end = i + 1;
    while (end < edges.size() && edges[end].is_edge_of(edges[i])) ++end;
    if (end == i + 2 && is_smooth(edges[i].low_corner / 3, edges[i + 1].low_corner / 3)) {
      sides.join(edges[i].low_corner, edges[i + 1].low_corner);
      sides.join(edges[i].high_corner, edges[i + 1].high_corner);
    }
    i = end;
  }

  const auto vertex_at = [&](uint32_t corner) { return mesh.faces[corner / 3][corner % 3]; };
  std::vector<uint32_t> roots;
  for (uint32_t c = 0; c < corners; ++c) {
    if (sides.root(c) == c) roots.push_back(c);
  }
  std::sort(roots.begin(), roots.end(), [&](uint32_t a, uint32_t b) {
    return std::pair(vertex_at(a), a) < std::pair(vertex_at(b), b);
  });
  ShadingVertices out;
  std::vector<uint32_t> number(corners);
  for (const uint32_t root : roots) {
    number[root] = static_cast<uint32_t>(out.vertex.size());
    out.vertex.push_back(vertex_at(root));
  }
  std::vector<Eigen::Vector3d> sums(roots.size(), Eigen::Vector3d::Zero());
  out.faces.resize(mesh.faces.size());
  for (uint32_t c = 0; c < corners; ++c) {
    const uint32_t v = number[sides.root(c)];
    out.faces[c / 3][c % 3] = v;
    sums[v] += areas[c / 3];
  }
  for (const Eigen::Vector3d& sum : sums)
    out.normal.push_back(sum.stableNormalized().cast<float>());
  return out;
}

}  // namespace cgs
