// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/optimal_bounding_box.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "meshing/measure/surface_measures.h"

namespace cgs {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

std::vector<uint32_t> used_vertices(const MeasurableMesh& mesh) {
  std::vector<uint8_t> used(mesh.points.size(), mesh.mesh.faces.empty() ? 1 : 0);
  for (const auto& face : mesh.mesh.faces) {
    for (const uint32_t v : face) used[v] = 1;
  }
  std::vector<uint32_t> out;
  for (uint32_t v = 0; v < used.size(); ++v) {
    if (used[v] != 0) out.push_back(v);
  }
  return out;
}

// Principal axes: exact for flat and straight sets, which have no box of smallest volume.
Eigen::Matrix3d principal_axes(const MeasurableMesh& mesh, const std::vector<uint32_t>& vertices) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const uint32_t v : vertices) mean += mesh.points[v];
  mean /= static_cast<double>(vertices.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const uint32_t v : vertices) {
    const Eigen::Vector3d d = mesh.points[v] - mean;
    covariance += d * d.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors();
}

Eigen::Vector3d extents_along(const MeasurableMesh& mesh,
                              const std::vector<uint32_t>& vertices,
                              const Eigen::Matrix3d& axes) {
  Eigen::AlignedBox3d box;
  for (const uint32_t v : vertices) box.extend(Eigen::Vector3d(axes.transpose() * mesh.points[v]));
  return box.sizes();
}

Eigen::Matrix3d smallest_box_axes(const MeasurableMesh& mesh,
                                  const std::vector<uint32_t>& vertices) {
  Eigen::Matrix3d axes = principal_axes(mesh, vertices);
  const Eigen::Vector3d sizes = extents_along(mesh, vertices, axes);
  constexpr double kFlat = 1e-9;  // of the largest extent
  if (sizes.minCoeff() <= kFlat * sizes.maxCoeff()) return axes;
  std::vector<Kernel::Point_3> points;
  points.reserve(vertices.size());
  for (const uint32_t v : vertices) {
    points.emplace_back(mesh.points[v].x(), mesh.points[v].y(), mesh.points[v].z());
  }
  std::array<Kernel::Point_3, 8> box;
  CGAL::oriented_bounding_box(points, box, CGAL::parameters::random_seed(0));
  const auto direction = [&](size_t to) {
    const Kernel::Vector_3 d = box.at(to) - box[0];
    return Eigen::Vector3d(d.x(), d.y(), d.z()).normalized();
  };
  // Of CGAL's corners, 1, 3 and 5 are the neighbours of 0.
  axes << direction(1), direction(3), direction(5);
  return axes;
}

// The largest extent first; right-handed.
Eigen::Matrix3d sorted_axes(const Eigen::Matrix3d& axes, const Eigen::Vector3d& sizes) {
  std::array<int, 3> order = {0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return sizes[a] != sizes[b] ? sizes[a] > sizes[b] : a < b;
  });
  Eigen::Matrix3d out;
  for (int k = 0; k < 3; ++k) out.col(k) = axes.col(order.at(static_cast<size_t>(k)));
  if (out.determinant() < 0) out.col(2) = -out.col(2);
  return out;
}

// A vertex belongs to the best evidence around it: an observed vertex on the rim of invented
// surface was observed.
std::vector<Provenance> vertex_labels(const MeasurableMesh& mesh) {
  std::vector<Provenance> out(mesh.points.size(), Provenance::Inferred);
  for (size_t f = 0; f < mesh.mesh.provenance.size(); ++f) {
    const Provenance label = mesh.mesh.provenance[f];
    for (const uint32_t v : mesh.mesh.faces[f]) {
      if (evidence_rank(label) > evidence_rank(out[v])) out[v] = label;
    }
  }
  return out;
}

MeasuredValue extent(const MeasurableMesh& mesh, uint32_t low, uint32_t high, double value) {
  MeasuredValue out;
  out.value = value;
  if (mesh.states_sigma()) {
    const double a = mesh.mesh.sigma[low];
    const double b = mesh.mesh.sigma[high];
    out.sigma = std::hypot(a, b);
    out.stated = (std::isfinite(a) ? 0.5 : 0) + (std::isfinite(b) ? 0.5 : 0);
  }
  return out;
}

}  // namespace

OrientedBox oriented_box(const MeasurableMesh& mesh) {
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  const std::vector<uint32_t> vertices = used_vertices(mesh);
  require(!vertices.empty(), "bounds need points, their number", vertices.size());
  Eigen::Matrix3d axes = smallest_box_axes(mesh, vertices);
  // No worse than the box along the axes of the file: CGAL's search is approximate.
  const Eigen::Vector3d upright = extents_along(mesh, vertices, Eigen::Matrix3d::Identity());
  if (upright.prod() <= extents_along(mesh, vertices, axes).prod() * (1 + 1e-9)) axes.setIdentity();
  OrientedBox out;
  out.axes = sorted_axes(axes, extents_along(mesh, vertices, axes));
  const std::vector<Provenance> labels = vertex_labels(mesh);
  Eigen::Vector3d middle;
  for (int k = 0; k < 3; ++k) {
    const auto along = [&](uint32_t v) { return out.axes.col(k).dot(mesh.points[v]); };
    const auto [low, high] =
        std::minmax_element(vertices.begin(), vertices.end(), [&](uint32_t a, uint32_t b) {
          return along(a) < along(b);
        });
    middle[k] = (along(*low) + along(*high)) / 2;
    MeasuredValue& value = out.extents.at(static_cast<size_t>(k));
    value = extent(mesh, *low, *high, along(*high) - along(*low));
    if (mesh.states_provenance()) {
      const bool low_is_weaker = evidence_rank(labels[*low]) < evidence_rank(labels[*high]);
      const Provenance weaker = low_is_weaker ? labels[*low] : labels[*high];
      value.by_provenance.at(static_cast<size_t>(weaker)) = value.value;
    }
  }
  out.center = out.axes * middle;
  return out;
}

}  // namespace cgs
