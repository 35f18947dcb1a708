// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "meshing/surface/isosurface.h"

namespace cgs {

namespace {

using openvdb::Coord;

// Corner k of a cell lies at (k & 1, k >> 1 & 1, k >> 2 & 1). Walks from corner 0 to 7 that turn
// one axis on after the other: all cells cut their faces along the same diagonals.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

Coord corner(const Coord& cell, int k) { return cell.offsetBy(k & 1, k >> 1 & 1, k >> 2 & 1); }

// A lattice edge: its lower corner and where it leads (1 to 7 as a corner of the cell there).
struct LatticeEdge {
  Coord from;
  int to;
  bool operator==(const LatticeEdge&) const = default;
};

struct LatticeEdgeHash {
  size_t operator()(const LatticeEdge& e) const {
    const auto mix = [](size_t h, int v) {
      return (h ^ static_cast<size_t>(static_cast<uint32_t>(v))) * size_t(0x9E3779B97F4A7C15);
    };
    const size_t h = mix(mix(mix(mix(0, e.from.x()), e.from.y()), e.from.z()), e.to);
    return h ^ h >> 32;
  }
};

class TetrahedraMesher {
 public:
  explicit TetrahedraMesher(const openvdb::FloatGrid& grid)
      : values_(grid.getConstAccessor()), voxel_(grid.voxelSize()[0]) {}

  void cell(const Coord& at) {
    std::array<float, 8> v{};
    int inside = 0;
    for (int k = 0; k < 8; ++k) {
      v.at(size_t(k)) = values_.getValue(corner(at, k));
      inside += v.at(size_t(k)) < 0;
    }
    if (inside == 0 || inside == 8) return;
    for (const auto& tetrahedron : kTetrahedra) cut(at, tetrahedron, v);
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  void cut(const Coord& at, const std::array<int, 4>& tet, const std::array<float, 8>& v) {
    std::array<int, 4> in{};
    std::array<int, 4> out{};
    size_t n_in = 0;
    size_t n_out = 0;
    for (const int k : tet) {
      if (v.at(size_t(k)) < 0) {
        in.at(n_in++) = k;
      } else {
        out.at(n_out++) = k;
      }
    }
    const auto on = [&](int a, int b) { return vertex(at, a, b, v); };
    if (n_in == 1) {
      face(at, in[0], true, {on(in[0], out[0]), on(in[0], out[1]), on(in[0], out[2])});
    } else if (n_out == 1) {
      face(at, out[0], false, {on(in[0], out[0]), on(in[1], out[0]), on(in[2], out[0])});
    } else if (n_in == 2) {
      const uint32_t a = on(in[0], out[0]);
      const uint32_t b = on(in[0], out[1]);
      const uint32_t c = on(in[1], out[1]);
      const uint32_t d = on(in[1], out[0]);
      face(at, in[0], true, {a, b, c});
      face(at, in[0], true, {a, c, d});
    }
  }

  // Adds the triangle so that the lattice corner `k` lies on its back if it is `inside`. All
  // corners of one sign lie on one side of the plane, so for a whole tetrahedron any of them will
  // do.
  void face(const Coord& at, int k, bool inside, std::array<uint32_t, 3> f) {
    const Coord c = corner(at, k);
    const Eigen::Vector3d p = voxel_ * Eigen::Vector3d(c.x(), c.y(), c.z());
    const Eigen::Vector3d a = mesh_.vertices[f[0]].cast<double>();
    const Eigen::Vector3d b = mesh_.vertices[f[1]].cast<double>();
    const Eigen::Vector3d d = mesh_.vertices[f[2]].cast<double>();
    const bool behind = (b - a).cross(d - a).dot(p - a) < 0;
    if (behind != inside) std::swap(f[1], f[2]);
    mesh_.faces.push_back(f);
  }

  uint32_t vertex(const Coord& at, int a, int b, const std::array<float, 8>& v) {
    if (a > b) std::swap(a, b);
    const LatticeEdge edge{corner(at, a), b - a};
    const auto [found, added] = known_.try_emplace(edge, uint32_t(mesh_.vertices.size()));
    if (added) {
      const auto va = double(v.at(size_t(a)));
      const auto vb = double(v.at(size_t(b)));
      // Room around the lattice corners: there the vertices of all edges would meet.
      constexpr double kRoom = 0.02;
      const double t = std::clamp(va / (va - vb), kRoom, 1 - kRoom);
      const Coord to = corner(at, b);
      const Eigen::Vector3d p(edge.from.x(), edge.from.y(), edge.from.z());
      const Eigen::Vector3d q(to.x(), to.y(), to.z());
      mesh_.vertices.emplace_back((voxel_ * ((1 - t) * p + t * q)).cast<float>());
    }
    return found->second;
  }

  openvdb::FloatGrid::ConstAccessor values_;
  double voxel_;
  TriangleMesh mesh_;
  std::unordered_map<LatticeEdge, uint32_t, LatticeEdgeHash> known_;
};

}  // namespace

TriangleMesh zero_surface_by_tetrahedra(const openvdb::FloatGrid& distance) {
  TetrahedraMesher mesher(distance);
  for (auto leaf = distance.tree().cbeginLeaf(); leaf; ++leaf) {
    for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) mesher.cell(voxel.getCoord());
  }
  return mesher.take();
}

}  // namespace cgs
