// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/certificate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <Eigen/Geometry>
#include <tbb/parallel_sort.h>

#include "libcgs/core/angle_between.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/mesh/shells.h"

namespace cgs {

namespace {

// A face side: the undirected edge, whether the face runs it upwards, and the face.
struct HalfEdge {
  uint32_t low;
  uint32_t high;
  uint32_t face;
  bool upwards;
  bool same_edge(const HalfEdge& other) const { return low == other.low && high == other.high; }
};

std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> edges(3 * mesh.faces.size());
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = mesh.faces[f][k];
      const uint32_t b = mesh.faces[f][(k + 1) % 3];
      edges[size_t{3} * f + k] = {std::min(a, b), std::max(a, b), f, a < b};
    }
  }
  tbb::parallel_sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.face, a.upwards) < std::tie(b.low, b.high, b.face, b.upwards);
  });
  return edges;
}

struct EdgeFacts {
  bool closed = true;
  bool manifold = true;
  bool consistent = true;
  size_t count = 0;
};

EdgeFacts edge_facts(const std::vector<HalfEdge>& edges) {
  EdgeFacts facts;
  facts.closed = !edges.empty();
  for (size_t i = 0; i < edges.size();) {
    size_t end = i + 1;
    while (end < edges.size() && edges[end].same_edge(edges[i])) ++end;
    const size_t faces = end - i;
    facts.closed = facts.closed && faces == 2;
    facts.manifold = facts.manifold && faces <= 2 && edges[i].low != edges[i].high;
    if (faces == 2) {
      facts.consistent = facts.consistent && edges[i].upwards != edges[i + 1].upwards;
    }
    ++facts.count;
    i = end;
  }
  return facts;
}

// Joins the corners of two faces that meet over an edge, at both of its vertices. A vertex is
// manifold iff that leaves its corners in one set.
class CornerFans {
 public:
  explicit CornerFans(const TriangleMesh& mesh) : mesh_(mesh) {
    for (size_t c = 0; c < 3 * mesh.faces.size(); ++c) parent_.push_back(c);
  }
  void join(const HalfEdge& a, const HalfEdge& b) {
    for (const uint32_t v : {a.low, a.high}) {
      const size_t x = root(corner(a.face, v));
      const size_t y = root(corner(b.face, v));
      parent_[std::max(x, y)] = std::min(x, y);
    }
  }
  bool one_per_vertex() {
    constexpr auto kUnset = static_cast<size_t>(-1);
    std::vector<size_t> fan(mesh_.vertices.size(), kUnset);
    for (size_t c = 0; c < parent_.size(); ++c) {
      size_t& known = fan[mesh_.faces[c / 3][c % 3]];
      if (known == kUnset) known = root(c);
      if (known != root(c)) return false;
    }
    return true;
  }

 private:
  size_t corner(uint32_t face, uint32_t v) const {
    const auto& f = mesh_.faces[face];
    return 3 * size_t(face) + size_t(std::find(f.begin(), f.end(), v) - f.begin());
  }
  size_t root(size_t c) {
    while (parent_[c] != c) c = parent_[c] = parent_[parent_[c]];
    return c;
  }
  const TriangleMesh& mesh_;
  std::vector<size_t> parent_;
};

bool vertex_manifold(const TriangleMesh& mesh, const std::vector<HalfEdge>& edges) {
  CornerFans fans(mesh);
  for (size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i].same_edge(edges[i + 1])) fans.join(edges[i], edges[i + 1]);
  }
  return fans.one_per_vertex();
}

// Components of negative volume are cavities: right only inside a component of positive volume.
bool cavities_are_inside(const TriangleMesh& mesh, const MeshComponents& parts) {
  std::vector<uint32_t> cavities;
  std::vector<uint32_t> bodies;
  for (uint32_t c = 0; c < parts.volume.size(); ++c) {
    (parts.volume[c] > 0 ? bodies : cavities).push_back(c);
  }
  if (cavities.empty()) return true;
  // The largest first: it has most of the cavities, if not all.
  std::stable_sort(bodies.begin(), bodies.end(), [&](uint32_t a, uint32_t b) {
    return parts.volume[a] > parts.volume[b];
  });
  const ShellNesting nesting(mesh, parts);
  for (const uint32_t body : bodies) {
    const std::vector<uint32_t> inside = nesting.within(body, cavities);
    std::erase_if(cavities,
                  [&](uint32_t c) { return std::binary_search(inside.begin(), inside.end(), c); });
    if (cavities.empty()) return true;
  }
  return false;
}

size_t used_vertices(const TriangleMesh& mesh) {
  std::vector<uint8_t> used(mesh.vertices.size(), 0);
  for (const auto& face : mesh.faces) {
    for (const uint32_t v : face) used[v] = 1;
  }
  return size_t(std::count(used.begin(), used.end(), uint8_t(1)));
}

double smallest_angle(const TriangleMesh& mesh) {
  double smallest = mesh.faces.empty() ? 0 : std::numbers::pi;
  for (const auto& f : mesh.faces) {
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = mesh.vertices[f.at(k)].cast<double>();
      const Eigen::Vector3d u = mesh.vertices[f.at((k + 1) % 3)].cast<double>() - p;
      const Eigen::Vector3d v = mesh.vertices[f.at((k + 2) % 3)].cast<double>() - p;
      smallest = std::min(smallest, angle_between(u, v));
    }
  }
  return smallest;
}

}  // namespace

bool is_closed_mesh(const TriangleMesh& mesh) { return edge_facts(sorted_half_edges(mesh)).closed; }

bool is_closed_manifold(const TriangleMesh& mesh) {
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  return edge_facts(edges).closed && vertex_manifold(mesh, edges);
}

void set_areas(Certificate& certificate, const TriangleMesh& mesh) {
  const auto areas = area_by_provenance(mesh);
  certificate.observed_area = areas[size_t(Provenance::Observed)];
  certificate.single_view_area = areas[size_t(Provenance::SingleView)];
  certificate.interpolated_area = areas[size_t(Provenance::Interpolated)];
  certificate.estimated_area = areas[size_t(Provenance::Estimated)];
  certificate.inferred_area = areas[size_t(Provenance::Inferred)];
  certificate.virtual_area = areas[size_t(Provenance::Virtual)];
}

Certificate certify(const TriangleMesh& mesh, const Progress& progress) {
  Certificate out;
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  const EdgeFacts facts = edge_facts(edges);
  const MeshComponents parts = components(mesh);
  out.closed = facts.closed;
  out.edge_manifold = facts.manifold;
  out.vertex_manifold = vertex_manifold(mesh, edges);
  out.components = parts.area.size();
  out.area = std::accumulate(parts.area.begin(), parts.area.end(), 0.0);
  out.euler_number = static_cast<long>(used_vertices(mesh)) - static_cast<long>(facts.count) +
                     static_cast<long>(mesh.faces.size());
  out.smallest_angle = smallest_angle(mesh);
  if (out.closed) {
    out.volume = std::accumulate(parts.volume.begin(), parts.volume.end(), 0.0);
    out.oriented_outward = facts.consistent && cavities_are_inside(mesh, parts);
    if (out.edge_manifold && out.vertex_manifold) {
      out.genus = static_cast<int>((2 * static_cast<long>(out.components) - out.euler_number) / 2);
    }
  }
  out.self_intersections = self_intersections(mesh, progress).size();
  set_areas(out, mesh);
  return out;
}

}  // namespace cgs
