// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/components.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>

#include "libcgs/core/disjoint_sets.h"

namespace cgs {

namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

Eigen::Vector3d box_center(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f box;
  for (const auto& p : points) box.extend(p);
  return points.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.center().cast<double>());
}

}  // namespace

MeshComponents components(const TriangleMesh& mesh) {
  DisjointSets parts(mesh.vertices.size());
  for (const auto& face : mesh.faces) {
    parts.join(face[0], face[1]);
    parts.join(face[0], face[2]);
  }
  MeshComponents out;
  out.of_face.reserve(mesh.faces.size());
  std::vector<uint32_t> number(mesh.vertices.size(), kNone);
  // Far from the origin the signed tetrahedra of the volume would cancel.
  const Eigen::Vector3d center = box_center(mesh.vertices);
  for (const auto& face : mesh.faces) {
    uint32_t& id = number[parts.root(face[0])];
    if (id == kNone) {
      id = static_cast<uint32_t>(out.area.size());
      out.area.push_back(0);
      out.volume.push_back(0);
    }
    out.of_face.push_back(id);
    const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>() - center;
    const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>() - center;
    const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>() - center;
    out.area[id] += 0.5 * (b - a).cross(c - a).norm();
    out.volume[id] += a.dot(b.cross(c)) / 6;
  }
  return out;
}

void grow_over_vertices(const TriangleMesh& mesh, std::vector<uint8_t>& faces) {
  std::vector<uint8_t> touched(mesh.vertices.size(), 0);
  for (size_t f = 0; f < faces.size(); ++f) {
    if (faces[f] == 0) continue;
    for (const uint32_t v : mesh.faces[f]) touched[v] = 1;
  }
  for (size_t f = 0; f < faces.size(); ++f) {
    for (const uint32_t v : mesh.faces[f]) {
      if (touched[v] != 0) faces[f] = 1;
    }
  }
}

TriangleMesh with_faces(const TriangleMesh& mesh, const std::vector<uint8_t>& keep) {
  assert(keep.size() == mesh.faces.size());
  TriangleMesh out;
  std::vector<uint8_t> used(mesh.vertices.size(), 0);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (keep[f] == 0) continue;
    for (const uint32_t v : mesh.faces[f]) used[v] = 1;
  }
  std::vector<uint32_t> renamed(mesh.vertices.size(), kNone);
  const auto copy = [](auto& to, const auto& from, size_t v) {
    if (!from.empty()) to.push_back(from[v]);
  };
  for (size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    renamed[v] = static_cast<uint32_t>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[v]);
    copy(out.normals, mesh.normals, v);
    copy(out.colors, mesh.colors, v);
    copy(out.support, mesh.support, v);
    copy(out.sigma, mesh.sigma, v);
  }
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (keep[f] == 0) continue;
    const auto& face = mesh.faces[f];
    out.faces.push_back({renamed[face[0]], renamed[face[1]], renamed[face[2]]});
    copy(out.provenance, mesh.provenance, f);
  }
  return out;
}

TriangleMesh without_unused_vertices(const TriangleMesh& mesh) {
  return with_faces(mesh, std::vector<uint8_t>(mesh.faces.size(), 1));
}

TriangleMesh without_small_components(const TriangleMesh& mesh, double relative_area) {
  const MeshComponents parts = components(mesh);
  if (parts.area.empty()) return mesh;
  const double smallest = relative_area * *std::max_element(parts.area.begin(), parts.area.end());
  std::vector<uint8_t> keep(mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) keep[f] = parts.area[parts.of_face[f]] >= smallest;
  return with_faces(mesh, keep);
}

}  // namespace cgs
