// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/loop_subdivision.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "meshing/edit/remeshing.h"
#include "meshing/mesh/face_split.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

using halfedges::EdgeHandle;
using halfedges::HalfedgeHandle;
using halfedges::HalfedgeMesh;

bool was_seen(const TriangleMesh& mesh, halfedges::FaceHandle face) {
  return !mesh.provenance.empty() && cgs::was_seen(mesh.provenance[size_t(face.idx())]);
}

/// An edge with the corners opposite to it.
struct Edge {
  uint32_t low, high;
  uint32_t tip, other_tip;
  bool sharp;
};

using Middle = OpenMesh::EPropHandleT<uint32_t>;

// Edges that repeat another have their middle in common with it.
// \param middle  of every edge its place in what is returned
std::vector<Edge> edges_of(const TriangleMesh& mesh, HalfedgeMesh& links, Middle middle) {
  std::vector<Edge> out;
  out.reserve(links.n_edges());
  for (const EdgeHandle e : links.edges()) {
    if (!halfedges::repeats_edge(links, e)) {
      std::array<HalfedgeHandle, 2> sides;  // the first and the last
      size_t count = 0;
      halfedges::for_each_side(
          links, e, [&](HalfedgeHandle side) { sides.at(count++ == 0 ? 0 : 1) = side; });
      if (count == 1) sides[1] = sides[0];
      const bool inside = count == 2 && was_seen(mesh, links.face_handle(sides[0])) ==
                                            was_seen(mesh, links.face_handle(sides[1]));
      const auto [low, high] = halfedges::ends_of(links, e);
      out.push_back({low,
                     high,
                     halfedges::tip_of(links, sides[0]),
                     halfedges::tip_of(links, sides[1]),
                     !inside});
    }
    links.property(middle, e) = static_cast<uint32_t>(out.size() - 1);
  }
  return out;
}

/// Sums over the neighbours of a vertex, all and those along sharp edges.
struct Around {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d sharp_sum = Eigen::Vector3d::Zero();
  size_t count = 0;
  size_t sharp = 0;

  void add(const Eigen::Vector3d& neighbor, bool is_sharp) {
    sum += neighbor;
    ++count;
    if (!is_sharp) return;
    sharp_sum += neighbor;
    ++sharp;
  }
  Eigen::Vector3d moved(const Eigen::Vector3d& p) const {
    if (sharp == 2) return 0.75 * p + 0.125 * sharp_sum;
    if (sharp != 0 || count == 0) return p;
    const double n = double(count);
    const double pull = 0.375 + 0.25 * std::cos(2 * std::numbers::pi / n);
    const double beta = (0.625 - pull * pull) / n;
    return (1 - n * beta) * p + beta * sum;
  }
};

// Where the vertices of the mesh, and then those in the middle of its edges, come to lie.
std::vector<Eigen::Vector3d> places(const TriangleMesh& mesh, const std::vector<Edge>& edges) {
  const auto at = [&](uint32_t v) -> Eigen::Vector3d { return mesh.vertices[v].cast<double>(); };
  std::vector<Around> around(mesh.vertices.size());
  for (const Edge& e : edges) {
    around[e.low].add(at(e.high), e.sharp);
    around[e.high].add(at(e.low), e.sharp);
  }
  std::vector<Eigen::Vector3d> out;
  out.reserve(mesh.vertices.size() + edges.size());
  for (uint32_t v = 0; v < around.size(); ++v) out.push_back(around[v].moved(at(v)));
  for (const Edge& e : edges) {
    const Eigen::Vector3d ends = at(e.low) + at(e.high);
    out.emplace_back(e.sharp
                         ? Eigen::Vector3d(ends / 2)
                         : Eigen::Vector3d(0.375 * ends + 0.125 * (at(e.tip) + at(e.other_tip))));
  }
  return out;
}

TriangleMesh loop_subdivided_once(const TriangleMesh& mesh) {
  HalfedgeMesh links = halfedges::halfedges_of(mesh);
  Middle middle;
  links.add_property(middle);
  const std::vector<Edge> edges = edges_of(mesh, links, middle);
  const std::vector<Eigen::Vector3d> to = places(mesh, edges);
  TriangleMesh out = mesh;
  out.faces.clear();
  out.provenance.clear();
  for (const Edge& e : edges) {
    append_blend(out, mesh, std::array<VertexShare, 2>{{{e.low, 0.5f}, {e.high, 0.5f}}});
  }
  for (size_t v = 0; v < to.size(); ++v) {
    const double moved = (to[v] - out.vertices[v].cast<double>()).norm();
    out.vertices[v] = to[v].cast<float>();
    if (out.sigma.empty() || moved == 0) continue;
    out.sigma[v] = static_cast<float>(std::hypot(double{out.sigma[v]}, moved));
  }
  const auto count = static_cast<uint32_t>(mesh.vertices.size());
  split_faces(
      mesh, links, [&](EdgeHandle e) { return count + links.property(middle, e); }, out);
  return out;
}

}  // namespace

TriangleMesh loop_subdivided(const TriangleMesh& mesh, size_t times) {
  require_room_to_subdivide(mesh, times);
  TriangleMesh out = mesh;
  for (size_t i = 0; i < times; ++i) out = loop_subdivided_once(out);
  if (!mesh.normals.empty()) out.normals = vertex_normals(out);
  return out;
}

}  // namespace cgs
