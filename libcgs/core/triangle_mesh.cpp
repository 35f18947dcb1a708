// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/triangle_mesh.h"

#include <Eigen/Geometry>

namespace cgs {

Eigen::Vector3d area_vector(const TriangleMesh& mesh, const std::array<uint32_t, 3>& face) {
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
  const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
  return (b - a).cross(c - a);
}

double face_area(const TriangleMesh& mesh, const std::array<uint32_t, 3>& face) {
  return 0.5 * area_vector(mesh, face).norm();
}

std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3d n = area_vector(mesh, face);
    for (const uint32_t v : face) sums[v] += n;
  }
  std::vector<Eigen::Vector3f> normals(sums.size(), Eigen::Vector3f::Zero());
  for (size_t v = 0; v < sums.size(); ++v) {
    const double length = sums[v].norm();
    if (length > 0) normals[v] = (sums[v] / length).cast<float>();
  }
  return normals;
}

std::array<double, kProvenanceCount> area_by_provenance(const TriangleMesh& mesh) {
  std::array<double, kProvenanceCount> area = {};
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto label =
        static_cast<size_t>(mesh.provenance.empty() ? Provenance::Inferred : mesh.provenance[f]);
    area.at(label) += face_area(mesh, mesh.faces[f]);
  }
  return area;
}

}  // namespace cgs
