// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/halfedges.h"

#include <string>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs::halfedges {

namespace {

/// The sides of all faces (3 * face + corner they start at) by their lower vertex: those of v are
/// at first[v] ... first[v + 1], sorted by their higher vertex and then by number.
struct SidesByVertex {
  std::vector<size_t> first;
  std::vector<uint64_t> sides;  // higher vertex << 32 | side

  uint32_t high(size_t at) const { return static_cast<uint32_t>(sides[at] >> 32); }
  uint32_t side(size_t at) const { return static_cast<uint32_t>(sides[at]); }
};

SidesByVertex sides_by_vertex(const TriangleMesh& mesh) {
  SidesByVertex out{std::vector<size_t>(mesh.vertices.size() + 1, 0),
                    std::vector<uint64_t>(3 * mesh.faces.size())};
  for (const auto& [a, b, c] : mesh.faces) {
    for (const uint32_t low : {std::min(a, b), std::min(b, c), std::min(c, a)}) {
      ++out.first[size_t{low} + 1];
    }
  }
  for (size_t v = 1; v < out.first.size(); ++v) out.first[v] += out.first[v - 1];
  std::vector<size_t> next(out.first.begin(), out.first.end() - 1);
  uint32_t side = 0;
  for (const auto& [a, b, c] : mesh.faces) {
    for (const auto& [low, high] : {std::minmax(a, b), std::minmax(b, c), std::minmax(c, a)}) {
      out.sides[next[low]++] = uint64_t{high} << 32 | side++;
    }
  }
  constexpr size_t kGrain = 4096;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, next.size(), kGrain), [&](const auto& range) {
    for (size_t v = range.begin(); v != range.end(); ++v) {
      std::sort(out.sides.data() + out.first[v], out.sides.data() + out.first[v + 1]);
    }
  });
  return out;
}

/// Fills the halfedges of a mesh whose vertices, edges and faces are there but know nothing.
class Linker {
 public:
  Linker(const TriangleMesh& mesh, HalfedgeMesh& out)
      : mesh_(mesh), out_(out), of_side_(3 * mesh.faces.size()) {}

  /// \param second  the side of the other face; nothing for a border edge
  void add_edge(uint32_t side, const uint32_t* second) {
    const HalfedgeHandle along = out_.halfedge_handle(EdgeHandle(edges_++), 0);
    const HalfedgeHandle back = out_.opposite_halfedge_handle(along);
    put(along, side);
    if (second != nullptr) {
      put(back, *second);
    } else {
      out_.set_vertex_handle(back, vertex(side));
      out_.set_boundary(back);
    }
  }

  void link() {
    for (uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      const HalfedgeHandle* sides = of_side_.data() + size_t{3} * f;
      for (size_t k = 0; k < 3; ++k) {
        out_.set_next_halfedge_handle(sides[k], sides[(k + 1) % 3]);
        out_.set_halfedge_handle(VertexHandle(int(mesh_.faces[f].at(k))), sides[k]);
      }
      out_.set_halfedge_handle(FaceHandle(int(f)), sides[0]);
    }
    for (int h = 0; h < static_cast<int>(out_.n_halfedges()); ++h) {
      if (out_.is_boundary(HalfedgeHandle(h))) link_border(HalfedgeHandle(h));
    }
  }

 private:
  VertexHandle vertex(uint32_t corner) const {
    return VertexHandle(int(mesh_.faces[corner / 3].at(corner % 3)));
  }
  void put(HalfedgeHandle halfedge, uint32_t side) {
    of_side_[side] = halfedge;
    out_.set_vertex_handle(halfedge, vertex(side % 3 == 2 ? side - 2 : side + 1));
    out_.set_face_handle(halfedge, FaceHandle(int(side / 3)));
  }
  // Turns around the vertex that a border runs to, through its fan, to where the border goes on.
  void link_border(HalfedgeHandle border) {
    HalfedgeHandle next = border;
    do {
      next = out_.opposite_halfedge_handle(next);
      next = out_.opposite_halfedge_handle(out_.prev_halfedge_handle(next));
    } while (!out_.is_boundary(next));
    out_.set_next_halfedge_handle(border, next);
    out_.set_halfedge_handle(out_.to_vertex_handle(border), next);
  }
  const TriangleMesh& mesh_;
  HalfedgeMesh& out_;
  std::vector<HalfedgeHandle> of_side_;
  int edges_ = 0;
};

// Calls `add` for every edge, with its sides; the second is null at a border.
template <typename Add>
void for_each_pair(const TriangleMesh& mesh, const SidesByVertex& sides, const Add& add) {
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto starts_low = [&](uint32_t side) { return mesh.faces[side / 3].at(side % 3) == v; };
    for (size_t i = sides.first[v]; i < sides.first[v + 1];) {
      size_t end = i + 1;
      while (end < sides.first[v + 1] && sides.high(end) == sides.high(i)) ++end;
      const uint32_t last = sides.side(end - 1);
      const bool is_shared = end == i + 2 && starts_low(sides.side(i)) != starts_low(last);
      if (is_shared) add(sides.side(i), &last);
      for (; !is_shared && i < end; ++i) add(sides.side(i), nullptr);
      i = end;
    }
  }
}

void require_few(uint64_t edges) {
  constexpr uint64_t kMost = uint64_t{1} << 30;
  if (edges <= kMost) return;
  throw LimitError("a mesh of " + std::to_string(edges) + " edges, allowed are 1073741824");
}

}  // namespace

HalfedgeMesh halfedges_of(const TriangleMesh& mesh) {
  require_few(mesh.faces.size());  // sides are numbered in 32 bits
  const SidesByVertex sides = sides_by_vertex(mesh);
  uint64_t edges = 0;
  for_each_pair(mesh, sides, [&](uint32_t, const uint32_t*) { ++edges; });
  require_few(edges);
  HalfedgeMesh out;
  out.resize(mesh.vertices.size(), edges, mesh.faces.size());
  Linker linker(mesh, out);
  for_each_pair(
      mesh, sides, [&](uint32_t side, const uint32_t* second) { linker.add_edge(side, second); });
  linker.link();
  return out;
}

std::vector<std::array<uint32_t, 3>> adjacent_faces(const TriangleMesh& mesh) {
  const HalfedgeMesh links = halfedges_of(mesh);
  std::vector<std::array<uint32_t, 3>> out(mesh.faces.size());
  for (const auto face : links.faces()) {
    size_t k = 0;
    for (const auto side : links.fh_range(face)) {
      out[size_t(face.idx())].at(k++) = static_cast<uint32_t>(face_across(links, side).idx());
    }
  }
  return out;
}

}  // namespace cgs::halfedges
