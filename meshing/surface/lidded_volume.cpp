// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/lidded_volume.h"

#include <limits>
#include <numeric>
#include <optional>

#include <Eigen/Geometry>

#include "libcgs/core/disjoint_sets.h"
#include "meshing/mesh/halfedges.h"

namespace cgs {

namespace {

/// A side that only one face has, in the direction of the face.
struct RimSide {
  uint32_t from = 0;
  uint32_t to = 0;
  uint32_t face = 0;
};

// Nothing where two faces have the same side in the same direction.
std::optional<std::vector<RimSide>> rim_sides(const TriangleMesh& mesh) {
  const auto links = halfedges::halfedges_of(mesh);
  for (const auto edge : links.edges()) {
    if (halfedges::repeats_edge(links, edge)) return std::nullopt;
  }
  std::vector<RimSide> out;
  for (const auto face : links.faces()) {
    for (const auto side : links.fh_range(face)) {
      if (!links.is_boundary(links.opposite_halfedge_handle(side))) continue;
      const auto vertex = [](auto v) { return static_cast<uint32_t>(v.idx()); };
      const RimSide rim{vertex(links.from_vertex_handle(side)),
                        vertex(links.to_vertex_handle(side)),
                        static_cast<uint32_t>(face.idx())};
      if (rim.from != rim.to) out.push_back(rim);  // not that of a face that names a vertex twice
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
