// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/halfedges.h"

#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs::halfedges {

namespace {

template <typename Work>
void for_each_parallel(size_t count, const Work& work) {
  constexpr size_t kGrain = 4096;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kGrain), [&](const auto& range) {
    for (size_t i = range.begin(); i != range.end(); ++i) work(i);
  });
}

/// A side of a face: 3 * face + the corner it starts at.
struct Side {
  uint64_t key = 0;  // to sort by: higher vertex << 32 | number << 1 | upwards

  uint32_t high() const { return static_cast<uint32_t>(key >> 32); }
  uint32_t number() const { return static_cast<uint32_t>(key) >> 1; }
  bool is_upwards() const { return (key & 1) != 0; }  // from its lower vertex to its higher one
};

/// The sides of all faces by their lower vertex: those of v are of[first[v] ... first[v + 1]).
struct SidesByVertex {
  std::vector<size_t> first;
  std::vector<Side> of;

  // Calls `visit` for each edge below v, with its sides; the second is null at a border.
  template <typename Visit>
  void for_each_edge(size_t v, const Visit& visit) const {
    for (size_t i = first[v]; i < first[v + 1];) {
      size_t end = i + 1;
      while (end < first[v + 1] && of[end].high() == of[i].high()) ++end;
      const bool is_shared = end == i + 2 && of[i].is_upwards() != of[i + 1].is_upwards();
      if (is_shared) visit(of[i], &of[i + 1]);
      for (; !is_shared && i < end; ++i) visit(of[i], nullptr);
      i = end;
    }
  }
};

SidesByVertex sides_by_vertex(const TriangleMesh& mesh) {
  SidesByVertex out{std::vector<size_t>(mesh.vertices.size() + 1, 0),
                    std::vector<Side>(3 * mesh.faces.size())};
  for (const auto& [a, b, c] : mesh.faces) {
    for (const uint32_t low : {std::min(a, b), std::min(b, c), std::min(c, a)}) {
      ++out.first[size_t{low} + 1];
    }
  }
  for (size_t v = 1; v < out.first.size(); ++v) out.first[v] += out.first[v - 1];
  std::vector<size_t> next(out.first.begin(), out.first.end() - 1);
  uint64_t number = 0;
  const auto add = [&](uint32_t from, uint32_t to) {
    const auto [low, high] = std::minmax(from, to);
    out.of[next[low]++].key = uint64_t{high} << 32 | number++ << 1 | (from == low ? 1 : 0);
  };
  for (const auto& [a, b, c] : mesh.faces) {
    add(a, b);
    add(b, c);
    add(c, a);
  }
  for_each_parallel(next.size(), [&](size_t v) {
    std::sort(out.of.data() + out.first[v],
              out.of.data() + out.first[v + 1],
              [](const Side& a, const Side& b) { return a.key < b.key; });
  });
  return out;
}

// Of every vertex the number of the first edge below it; at the end that of all.
std::vector<uint64_t> first_edges(const SidesByVertex& sides) {
  std::vector<uint64_t> out(sides.first.size(), 0);
  for_each_parallel(out.size() - 1, [&](size_t v) {
    sides.for_each_edge(v, [&](const Side&, const Side*) { ++out[v + 1]; });
  });
  for (size_t v = 1; v < out.size(); ++v) out[v] += out[v - 1];
  return out;
}

/// Fills the halfedges of a mesh whose vertices, edges and faces are there but know nothing.
class Linker {
 public:
  Linker(const TriangleMesh& mesh, HalfedgeMesh& out)
      : mesh_(mesh), out_(out), of_side_(3 * mesh.faces.size()) {}

  /// \param second  of the other face; null for a border edge
  void put_edge(EdgeHandle edge, uint32_t low, const Side& side, const Side* second) {
    const HalfedgeHandle along = out_.halfedge_handle(edge, 0);
    const HalfedgeHandle back = out_.halfedge_handle(edge, 1);
    put(along, side);
    if (second != nullptr) put(back, *second);
    const VertexHandle lower(static_cast<int>(low));
    const VertexHandle higher(static_cast<int>(side.high()));
    out_.set_vertex_handle(along, side.is_upwards() ? higher : lower);
    out_.set_vertex_handle(back, side.is_upwards() ? lower : higher);
  }

  void link() {
    for_each_parallel(mesh_.faces.size(), [&](size_t f) {
      const HalfedgeHandle* sides = of_side_.data() + 3 * f;
      for (size_t k = 0; k < 3; ++k) out_.set_next_halfedge_handle(sides[k], sides[(k + 1) % 3]);
      out_.set_halfedge_handle(FaceHandle(static_cast<int>(f)), sides[0]);
    });
    const HalfedgeHandle* side = of_side_.data();
    for (const auto& face : mesh_.faces) {
      for (const uint32_t v : face) {
        out_.set_halfedge_handle(VertexHandle(static_cast<int>(v)), *side++);
      }
    }
    for (const auto edge : out_.edges()) {
      const HalfedgeHandle back = out_.halfedge_handle(edge, 1);
      if (out_.is_boundary(back)) link_border(back);
    }
    link_touching();
  }

 private:
  void put(HalfedgeHandle halfedge, const Side& side) {
    of_side_[side.number()] = halfedge;
    out_.set_face_handle(halfedge, FaceHandle(static_cast<int>(side.number() / 3)));
  }
  // Turns around the vertex that a border runs to, through its fan, to the other border of that.
  void link_border(HalfedgeHandle border) {
    HalfedgeHandle next = out_.opposite_halfedge_handle(border);
    do {
      next = out_.opposite_halfedge_handle(out_.prev_halfedge_handle(next));
    } while (!out_.is_boundary(next));
    out_.set_next_halfedge_handle(border, next);
    const VertexHandle at = out_.to_vertex_handle(border);
    if (out_.is_boundary(out_.halfedge_handle(at))) {
      touching_.push_back(border);
    } else {
      out_.set_halfedge_handle(at, next);
    }
  }

  /// An open fan of faces around a vertex, by the border that runs into it.
  struct Fan {
    HalfedgeHandle border;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // sum of directions to its faces
    Eigen::Vector3d area = Eigen::Vector3d::Zero();    // sum of its area vectors
    double angle = 0;
  };
  Fan fan_of(HalfedgeHandle border) const {
    Fan out{border};
    const auto place = [&](VertexHandle v) -> Eigen::Vector3d {
      return mesh_.vertices[static_cast<size_t>(v.idx())].cast<double>();
    };
    const Eigen::Vector3d center = place(out_.to_vertex_handle(border));
    HalfedgeHandle side = out_.opposite_halfedge_handle(border);
    do {
      const Eigen::Vector3d a = place(out_.to_vertex_handle(side)) - center;
      side = out_.prev_halfedge_handle(side);
      const Eigen::Vector3d b = place(out_.from_vertex_handle(side)) - center;
      out.middle += a + b;
      out.area += a.cross(b);
      side = out_.opposite_halfedge_handle(side);
    } while (!out_.is_boundary(side));
    return out;
  }

  // Where fans touch at a vertex, a border goes on along the fan that lies next around it, so that
  // holes that touch have rims of their own.
  void link_fans(std::vector<Fan> fans) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (const Fan& fan : fans) normal += fan.area;
    const Eigen::Vector3d x = normal.unitOrthogonal();
    const Eigen::Vector3d y = normal.normalized().cross(x);
    for (Fan& fan : fans) {
      const double angle = std::atan2(fan.middle.dot(y), fan.middle.dot(x));
      if (std::isfinite(angle)) fan.angle = angle;
    }
    std::stable_sort(
        fans.begin(), fans.end(), [](const Fan& a, const Fan& b) { return a.angle > b.angle; });
    const HalfedgeHandle first = out_.next_halfedge_handle(fans[0].border);
    for (size_t i = 0; i < fans.size(); ++i) {
      const bool is_last = i + 1 == fans.size();
      out_.set_next_halfedge_handle(
          fans[i].border, is_last ? first : out_.next_halfedge_handle(fans[i + 1].border));
    }
  }

  void link_touching() {
    const auto at = [&](HalfedgeHandle border) { return out_.to_vertex_handle(border); };
    std::stable_sort(touching_.begin(), touching_.end(), [&](HalfedgeHandle a, HalfedgeHandle b) {
      return at(a) < at(b);
    });
    for (size_t i = 0; i < touching_.size();) {
      const VertexHandle vertex = at(touching_[i]);
      std::vector<Fan> fans = {fan_of(out_.prev_halfedge_handle(out_.halfedge_handle(vertex)))};
      for (; i < touching_.size() && at(touching_[i]) == vertex; ++i) {
        fans.push_back(fan_of(touching_[i]));
      }
      link_fans(std::move(fans));
    }
  }

  const TriangleMesh& mesh_;
  HalfedgeMesh& out_;
  std::vector<HalfedgeHandle> of_side_;
  std::vector<HalfedgeHandle> touching_;  // borders into vertices that others run into, too
};

void require_few(uint64_t edges) {
  constexpr uint64_t kMost = uint64_t{1} << 30;
  if (edges <= kMost) return;
  throw LimitError("a mesh of " + std::to_string(edges) + " edges, allowed are 1073741824");
}

}  // namespace

void fill_halfedges(const TriangleMesh& mesh, HalfedgeMesh& out) {
  require_few((3 * mesh.faces.size() + 1) / 2);  // no edge has more than two sides
  const SidesByVertex sides = sides_by_vertex(mesh);
  const std::vector<uint64_t> first = first_edges(sides);
  require_few(first.back());
  out.resize(mesh.vertices.size(), first.back(), mesh.faces.size());
  Linker linker(mesh, out);
  for_each_parallel(mesh.vertices.size(), [&](size_t v) {
    int edge = static_cast<int>(first[v]);
    sides.for_each_edge(v, [&](const Side& side, const Side* second) {
      linker.put_edge(EdgeHandle(edge++), static_cast<uint32_t>(v), side, second);
    });
  });
  linker.link();
}

HalfedgeMesh halfedges_of(const TriangleMesh& mesh) {
  HalfedgeMesh out;
  fill_halfedges(mesh, out);
  return out;
}

bool is_manifold(const HalfedgeMesh& mesh) {
  for (const auto edge : mesh.edges()) {
    const auto [low, high] = ends_of(mesh, edge);
    if (low == high || repeats_edge(mesh, edge)) return false;
  }
  std::vector<uint32_t> corners(mesh.n_vertices(), 0);
  for (const auto face : mesh.faces()) {
    for (const auto v : mesh.fv_range(face)) ++corners[size_t(v.idx())];
  }
  for (const auto v : mesh.vertices()) {
    for (const auto side : mesh.voh_range(v)) {
      if (!mesh.is_boundary(side)) --corners[size_t(v.idx())];
    }
    if (corners[size_t(v.idx())] != 0) return false;
  }
  return true;
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
