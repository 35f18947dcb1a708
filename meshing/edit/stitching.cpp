// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/stitching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <utility>
#include <vector>

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <Eigen/Geometry>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/face_adjacency.h"
#include "meshing/edit/repair.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/places.h"
#include "meshing/mesh/polygon_mesh.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

using Kernel = polygon_mesh::Kernel;
using Segment = Kernel::Segment_3;
using Segments = std::vector<Segment>;
using SegmentTree = CGAL::AABB_tree<
    CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, Segments::iterator>>>;

// The sides of faces that no other face shares.
std::vector<FaceSide> rim_sides(const TriangleMesh& mesh) {
  const std::vector<FaceSide> sides = sides_by_edge(mesh);
  std::vector<FaceSide> out;
  for (size_t i = 0; i < sides.size();) {
    size_t end = i + 1;
    while (end < sides.size() && sides[end].same_edge(sides[i])) ++end;
    if (end == i + 1 && sides[i].low != sides[i].high) out.push_back(sides[i]);
    i = end;
  }
  return out;
}

uint64_t edge_key(uint32_t a, uint32_t b) {
  return (uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

// A vertex on the inside of a side of a face.
struct Junction {
  double along = 0;  // 0 to 1
  uint32_t vertex = 0;
};

/// The vertices on the rim sides of a mesh.
class Junctions {
 public:
  explicit Junctions(const TriangleMesh& mesh) : mesh_(mesh), sides_(rim_sides(mesh)) {
    on_side_.resize(sides_.size());
    find();
    for (auto& found : on_side_) {
      std::sort(found.begin(), found.end(), [](const Junction& a, const Junction& b) {
        return std::make_pair(a.along, a.vertex) < std::make_pair(b.along, b.vertex);
      });
    }
    keep_those_of_other_rims();
  }

  size_t count() const {
    return std::accumulate(
        on_side_.begin(), on_side_.end(), size_t(0), [](size_t sum, const auto& found) {
          return sum + found.size();
        });
  }

  // Per face and side, in the direction of the face; faces without any are left out.
  using OfFace = std::array<std::vector<uint32_t>, 3>;
  std::vector<std::pair<uint32_t, OfFace>> by_face() const {
    std::vector<size_t> order;
    for (size_t i = 0; i < sides_.size(); ++i) {
      if (!on_side_[i].empty()) order.push_back(i);
    }
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      return std::make_pair(sides_[a].face, sides_[a].side) <
             std::make_pair(sides_[b].face, sides_[b].side);
    });
    std::vector<std::pair<uint32_t, OfFace>> out;
    for (const size_t i : order) {
      const FaceSide& side = sides_[i];
      if (out.empty() || out.back().first != side.face) out.push_back({side.face, {}});
      for (const Junction& j : on_side_[i]) out.back().second.at(side.side).push_back(j.vertex);
    }
    return out;
  }

 private:
  uint32_t from(const FaceSide& side) const { return mesh_.faces[side.face].at(side.side); }
  uint32_t to(const FaceSide& side) const { return mesh_.faces[side.face].at((side.side + 1) % 3); }
  Eigen::Vector3d place(uint32_t v) const { return mesh_.vertices[v].cast<double>(); }

  void find() {
    Segments segments;
    std::vector<uint32_t> vertices;
    Eigen::AlignedBox3d box;
    for (const FaceSide& side : sides_) {
      segments.emplace_back(polygon_mesh::point_of(mesh_.vertices[from(side)]),
                            polygon_mesh::point_of(mesh_.vertices[to(side)]));
      vertices.insert(vertices.end(), {side.low, side.high});
    }
    for (const auto& p : mesh_.vertices) box.extend(p.cast<double>());
    if (segments.empty()) return;
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    constexpr double kNear = 1e-5;  // of the diagonal: coordinates in files have six digits or more
    const double near = kNear * box.diagonal().norm();
    const SegmentTree tree(segments.begin(), segments.end());
    std::vector<Segments::iterator> hits;
    for (const uint32_t v : vertices) {
      const Eigen::Vector3d low = place(v).array() - near;
      const Eigen::Vector3d high = place(v).array() + near;
      hits.clear();
      tree.all_intersected_primitives(
          Kernel::Iso_cuboid_3({low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}),
          std::back_inserter(hits));
      for (const auto& hit : hits) try_vertex(static_cast<size_t>(hit - segments.begin()), v, near);
    }
  }

  void try_vertex(size_t i, uint32_t v, double near) {
    constexpr double kShare = 0.01;  // of the way to an end of the edge
    const auto& face = mesh_.faces[sides_[i].face];
    if (std::find(face.begin(), face.end(), v) != face.end()) return;
    const Eigen::Vector3d a = place(from(sides_[i]));
    const Eigen::Vector3d edge = place(to(sides_[i])) - a;
    const double along = (place(v) - a).dot(edge) / edge.squaredNorm();
    if (!(along > 0 && along < 1)) return;
    const double off = (place(v) - a - along * edge).norm();
    const double to_end = std::min(along, 1 - along) * edge.norm();
    if (off <= near && off <= kShare * to_end && to_end > near) on_side_[i].push_back({along, v});
  }

  // Edges of the rims as they are once all are split.
  std::vector<uint64_t> pieces() const {
    std::vector<uint64_t> out;
    for (size_t i = 0; i < sides_.size(); ++i) {
      uint32_t last = from(sides_[i]);
      for (const Junction& j : on_side_[i]) {
        out.push_back(edge_key(last, j.vertex));
        last = j.vertex;
      }
      out.push_back(edge_key(last, to(sides_[i])));
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  // A rim that only touches an edge with a corner does not hang together with it.
  void keep_those_of_other_rims() {
    const std::vector<uint64_t> all = pieces();
    const auto is_shared = [&](uint32_t a, uint32_t b) {
      const auto [begin, end] = std::equal_range(all.begin(), all.end(), edge_key(a, b));
      return end - begin > 1;
    };
    for (size_t i = 0; i < sides_.size(); ++i) {
      const std::vector<Junction> found = std::move(on_side_[i]);
      on_side_[i].clear();
      for (size_t k = 0; k < found.size(); ++k) {
        const uint32_t before = k == 0 ? from(sides_[i]) : found[k - 1].vertex;
        const uint32_t after = k + 1 == found.size() ? to(sides_[i]) : found[k + 1].vertex;
        const uint32_t v = found[k].vertex;
        if (is_shared(before, v) || is_shared(v, after)) on_side_[i].push_back(found[k]);
      }
    }
  }

  const TriangleMesh& mesh_;
  std::vector<FaceSide> sides_;
  std::vector<std::vector<Junction>> on_side_;
};

// A face with vertices on its sides as triangles, none of them flat if the face is not.
void append_split(const std::array<uint32_t, 3>& face,
                  const Junctions::OfFace& on,
                  std::vector<std::array<uint32_t, 3>>& out) {
  size_t k = 0;
  while (k < 3 && on.at(k).empty()) ++k;
  if (k == 3) {
    out.push_back(face);
    return;
  }
  const uint32_t apex = face.at((k + 2) % 3);
  std::vector<uint32_t> ends = {face.at(k)};
  ends.insert(ends.end(), on.at(k).begin(), on.at(k).end());
  ends.push_back(face.at((k + 1) % 3));
  for (size_t i = 0; i + 1 < ends.size(); ++i) {
    Junctions::OfFace rest;
    if (i == 0) rest[2] = on.at((k + 2) % 3);
    if (i + 2 == ends.size()) rest[1] = on.at((k + 1) % 3);
    append_split({ends[i], ends[i + 1], apex}, rest, out);
  }
}

// --- seams ----------------------------------------------------------------------------------

/// Finds which vertices along rims are one.
class Seams {
 public:
  explicit Seams(const TriangleMesh& mesh)
      : mesh_(mesh), places_(first_at_place(mesh.vertices)), sets_(mesh.vertices.size()) {
    mark_flat_faces();
    for (const FaceSide& side : rim_sides(mesh)) add(side);
    std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) {
      return std::make_pair(a.key, a.from) < std::make_pair(b.key, b.from);
    });
    for (size_t i = 0; i < sides_.size();) {
      size_t end = i + 1;
      while (end < sides_.size() && sides_[end].key == sides_[i].key) ++end;
      if (end == i + 2) join(sides_[i], sides_[i + 1]);
      i = end;
    }
  }

  uint32_t root(uint32_t v) { return sets_.root(v); }

 private:
  struct Side {
    uint64_t key;  // of the places at its ends
    uint32_t from, to;
  };

  // Their corners would become one.
  void mark_flat_faces() {
    is_held_.assign(mesh_.vertices.size(), 0);
    for (const auto& [a, b, c] : mesh_.faces) {
      const bool is_flat =
          places_[a] == places_[b] || places_[b] == places_[c] || places_[c] == places_[a];
      if (is_flat) is_held_[a] = is_held_[b] = is_held_[c] = 1;
    }
  }

  void add(const FaceSide& side) {
    const auto& face = mesh_.faces[side.face];
    const uint32_t from = face.at(side.side);
    const uint32_t to = face.at((side.side + 1) % 3);
    sides_.push_back({edge_key(places_[from], places_[to]), from, to});
  }

  bool may_join(uint32_t a, uint32_t b) const {
    return is_held_[a] == 0 && is_held_[b] == 0 && !are_of_other_colors(mesh_, a, b);
  }

  void join(const Side& a, const Side& b) {
    const bool run_against = places_[a.from] == places_[b.to];  // else one of the faces is turned
    if (!run_against || !may_join(a.from, b.to) || !may_join(a.to, b.from)) return;
    sets_.join(a.from, b.to);
    sets_.join(a.to, b.from);
  }

  const TriangleMesh& mesh_;
  std::vector<uint32_t> places_;  // per vertex the first one there
  DisjointSets sets_;
  std::vector<uint8_t> is_held_;
  std::vector<Side> sides_;
};

}  // namespace

std::optional<StitchedMesh> without_t_junctions(const TriangleMesh& mesh) {
  const Junctions junctions(mesh);
  const size_t count = junctions.count();
  if (count == 0) return std::nullopt;
  StitchedMesh out{mesh, count};
  for (const auto& [f, on] : junctions.by_face()) {
    std::vector<std::array<uint32_t, 3>> parts;
    append_split(mesh.faces[f], on, parts);
    out.mesh.faces[f] = parts.front();
    out.mesh.faces.insert(out.mesh.faces.end(), parts.begin() + 1, parts.end());
    if (!mesh.provenance.empty()) {
      out.mesh.provenance.resize(out.mesh.faces.size(), mesh.provenance[f]);
    }
  }
  return out;
}

std::optional<StitchedMesh> with_joined_seams(const TriangleMesh& mesh) {
  if (mesh.faces.empty() || repeated_vertices(mesh) == 0) return std::nullopt;
  Seams seams(mesh);
  StitchedMesh out{mesh, 0};
  for (uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const uint32_t kept = seams.root(v);
    if (kept == v) continue;
    take_weaker_claims(out.mesh, kept, v);
    ++out.vertices;
  }
  if (out.vertices == 0) return std::nullopt;
  for (auto& face : out.mesh.faces) {
    for (uint32_t& v : face) v = seams.root(v);
  }
  out.mesh = without_unused_vertices(out.mesh);
  if (!mesh.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  return out;
}

}  // namespace cgs
