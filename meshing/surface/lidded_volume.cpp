// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/lidded_volume.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <optional>

#include <Eigen/Geometry>

#include "libcgs/core/disjoint_sets.h"

namespace cgs {

namespace {

/// A side that only one face has, in the direction of the face.
struct RimSide {
  uint32_t from = 0;
  uint32_t to = 0;
  uint32_t face = 0;
};

uint64_t key(uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; }

// Nothing where two faces have the same side in the same direction.
std::optional<std::vector<RimSide>> rim_sides(const TriangleMesh& mesh) {
  std::vector<uint64_t> sides;
  sides.reserve(3 * mesh.faces.size());
  for (const auto& [a, b, c] : mesh.faces) {
    sides.insert(sides.end(), {key(a, b), key(b, c), key(c, a)});
  }
  std::sort(sides.begin(), sides.end());
  if (std::adjacent_find(sides.begin(), sides.end()) != sides.end()) return std::nullopt;
  std::vector<RimSide> out;
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = mesh.faces[f].at(k);
      const uint32_t b = mesh.faces[f].at((k + 1) % 3);
      if (!std::binary_search(sides.begin(), sides.end(), key(b, a))) out.push_back({a, b, f});
    }
  }
  return out;
}

}  // namespace

std::vector<double> lidded_volumes(const TriangleMesh& mesh, const MeshComponents& parts) {
  const auto rims = rim_sides(mesh);
  if (mesh.faces.empty() || !rims) return {};
  std::vector<double> sums(parts.area.size(), 0);
  const Eigen::Vector3d center = mesh.vertices[mesh.faces[0][0]].cast<double>();
  const auto at = [&](uint32_t v) -> Eigen::Vector3d {
    return mesh.vertices[v].cast<double>() - center;
  };
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    sums[parts.of_face[f]] += at(a).dot(at(b).cross(at(c))) / 6;
  }
  DisjointSets rim_of(mesh.vertices.size());
  for (const RimSide& side : *rims) rim_of.join(side.from, side.to);
  std::vector<Eigen::Vector4d> middle(mesh.vertices.size(), Eigen::Vector4d::Zero());
  for (const RimSide& side : *rims) middle[rim_of.root(side.from)] += at(side.from).homogeneous();
  for (const RimSide& side : *rims) {
    const Eigen::Vector3d tip = middle[rim_of.root(side.from)].hnormalized();
    sums[parts.of_face[side.face]] += at(side.to).dot(at(side.from).cross(tip)) / 6;
  }
  return sums;
}

double lidded_volume(const TriangleMesh& mesh) {
  const std::vector<double> volumes = lidded_volumes(mesh, components(mesh));
  if (volumes.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::accumulate(volumes.begin(), volumes.end(), 0.0);
}

}  // namespace cgs
