// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/cropping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "meshing/mesh/components.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

/// A mesh while it is cut by one plane.
class PlaneCut {
 public:
  PlaneCut(const TriangleMesh& mesh, std::vector<double> heights)
      : mesh_(mesh), heights_(std::move(heights)), kept_(mesh.vertices.size(), 0) {
    for (uint32_t v = 0; v < kept_.size(); ++v) {
      if (heights_[v] < 0) continue;
      kept_[v] = static_cast<uint32_t>(out_.vertices.size());
      append_vertex(out_, mesh_, v);
    }
  }

  TriangleMesh result() {
    for (size_t f = 0; f < mesh_.faces.size(); ++f) add_face(f);
    return std::move(out_);
  }

 private:
  bool inside(uint32_t v) const { return heights_[v] >= 0; }

  void add_face(size_t f) {
    std::array<uint32_t, 4> corners{};
    size_t count = 0;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = mesh_.faces[f][k];
      const uint32_t b = mesh_.faces[f][(k + 1) % 3];
      if (inside(a)) corners.at(count++) = kept_[a];
      if (inside(a) != inside(b)) corners.at(count++) = crossing(a, b);
    }
    for (size_t k = 2; k < count; ++k) {
      const std::array<uint32_t, 3> face = {corners[0], corners.at(k - 1), corners.at(k)};
      if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
      out_.faces.push_back(face);
      if (!mesh_.provenance.empty()) out_.provenance.push_back(mesh_.provenance[f]);
    }
  }

  // The vertex where the plane cuts an edge, the same for both of its faces.
  uint32_t crossing(uint32_t a, uint32_t b) {
    if (!inside(a)) std::swap(a, b);
    if (heights_[a] == 0) return kept_[a];
    const auto [at, is_new] = crossings_.try_emplace(uint64_t{a} << 32 | b, 0);
    if (!is_new) return at->second;
    at->second = static_cast<uint32_t>(out_.vertices.size());
    const auto t = static_cast<float>(heights_[a] / (heights_[a] - heights_[b]));
    append_blend(out_, mesh_, std::array<VertexShare, 2>{{{a, 1 - t}, {b, t}}});
    return at->second;
  }

  const TriangleMesh& mesh_;
  TriangleMesh out_;
  std::vector<double> heights_;
  std::vector<uint32_t> kept_;
  std::unordered_map<uint64_t, uint32_t> crossings_;
};

// Of a mesh, vertices that no face uses are of no use.
TriangleMesh without_unused(const TriangleMesh& cut, bool was_cloud) {
  return was_cloud ? cut : without_unused_vertices(cut);
}

}  // namespace

TriangleMesh cropped_by_plane(const TriangleMesh& mesh,
                              const Eigen::Vector3d& point,
                              const Eigen::Vector3d& normal) {
  std::vector<double> heights;
  heights.reserve(mesh.vertices.size());
  // What float cannot tell from the plane lies on it, so that no face is cut into a sliver; near 0,
  // where floats are finer than the mesh is, what is nothing beside its size.
  constexpr double kOnPlane = 0x1p-21;
  Eigen::AlignedBox3f box;
  for (const auto& p : mesh.vertices) box.extend(p);
  const Eigen::Vector3d size =
      mesh.vertices.empty() ? Eigen::Vector3d::Zero().eval() : box.sizes().cast<double>().eval();
  for (const auto& p : mesh.vertices) {
    const double height = (p.cast<double>() - point).dot(normal);
    const Eigen::Vector3d reach = p.cast<double>().cwiseAbs().cwiseMax(size);
    const double least = kOnPlane * reach.dot(normal.cwiseAbs());
    heights.push_back(std::abs(height) <= least ? 0 : height);
  }
  return without_unused(PlaneCut(mesh, std::move(heights)).result(), mesh.faces.empty());
}

TriangleMesh cropped_by_box(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box) {
  TriangleMesh out = mesh;
  const bool is_cloud = mesh.faces.empty();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      if (!is_cloud && out.faces.empty()) return {};
      const Eigen::Vector3d& corner = side > 0 ? box.min() : box.max();
      out = cropped_by_plane(out, corner, side * Eigen::Vector3d::Unit(axis));
    }
  }
  return out;
}

TriangleMesh cropped_by_ball(const TriangleMesh& mesh,
                             const Eigen::Vector3d& center,
                             double radius) {
  std::vector<uint8_t> keep;
  keep.reserve(mesh.vertices.size());
  for (const auto& p : mesh.vertices) {
    keep.push_back((p.cast<double>() - center).norm() <= radius ? 1 : 0);
  }
  return with_vertices(mesh, keep);
}

}  // namespace cgs
