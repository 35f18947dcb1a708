// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/crease_normals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/face_adjacency.h"

namespace cgs {

namespace {

// Corners, three to a face, that share a normal: those of one vertex on one side of all creases.
DisjointSets sides_of_creases(const TriangleMesh& mesh,
                              const std::vector<Eigen::Vector3d>& areas,
                              double largest_angle) {
  const double least = std::cos(largest_angle * std::numbers::pi / 180);
  const auto is_smooth = [&](uint32_t f, uint32_t g) {
    return areas[f].dot(areas[g]) >= least * areas[f].norm() * areas[g].norm();
  };
  const auto corner_at = [&](const FaceSide& s, uint32_t vertex) {
    return 3 * s.face + (mesh.faces[s.face].at(s.side) == vertex ? s.side : (s.side + 1) % 3);
  };
  DisjointSets out(mesh.faces.size() * 3);
  const std::vector<FaceSide> edges = sides_by_edge(mesh);
  for (size_t i = 0; i < edges.size();) {
    size_t end = i + 1;
    while (end < edges.size() && edges[end].same_edge(edges[i])) ++end;
    if (end == i + 2 && is_smooth(edges[i].face, edges[i + 1].face)) {
      for (const uint32_t vertex : {edges[i].low, edges[i].high}) {
        out.join(corner_at(edges[i], vertex), corner_at(edges[i + 1], vertex));
      }
    }
    i = end;
  }
  return out;
}

}  // namespace

ShadingVertices split_at_creases(const TriangleMesh& mesh, double largest_angle) {
  std::vector<Eigen::Vector3d> areas;
  areas.reserve(mesh.faces.size());
  for (const auto& face : mesh.faces) areas.push_back(area_vector(mesh, face));
  DisjointSets sides = sides_of_creases(mesh, areas, largest_angle);
  const auto corners = static_cast<uint32_t>(mesh.faces.size() * 3);
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
  for (const Eigen::Vector3d& sum : sums) {
    out.normal.push_back(sum.stableNormalized().cast<float>());
  }
  return out;
}

}  // namespace cgs
