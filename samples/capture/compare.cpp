// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/compare.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Eigen::Vector3d;

template <typename A, typename B>
void require_same_size(const Raster<A>& a, const Raster<B>& b) {
  require(
      a.width == b.width && a.height == b.height,
      "rasters must have the size " + std::to_string(b.width) + " x " + std::to_string(b.height),
      std::to_string(a.width) + " x " + std::to_string(a.height));
}

// Axes that look the way the inputs look on average; rows of the rotation are right, down, forward.
Eigen::Matrix3d mean_view_axes(std::span<const Camera> inputs) {
  Vector3d forward = Vector3d::Zero();
  for (const auto& camera : inputs) forward += camera.world_from_cam.linear().col(2);
  forward.normalize();
  const Vector3d right = inputs.front().world_from_cam.linear().col(0);
  const Vector3d down = forward.cross(right).normalized();
  Eigen::Matrix3d axes;
  axes << down.cross(forward).transpose(), down.transpose(), forward.transpose();
  return axes;
}

// Bounds, in the given axes, of the surface points that two inputs or more see.
Eigen::AlignedBox3d observed_bounds(const PortalScene& scene,
                                    std::span<const Camera> inputs,
                                    const Eigen::Matrix3d& axes) {
  Eigen::AlignedBox3d bounds;
  for (const auto& camera : inputs) {
    const ViewTruth truth = view_truth(scene, camera, inputs);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        if (truth.seen(x, y) < 2) continue;
        const auto depth = static_cast<double>(truth.depth(x, y));
        bounds.extend(axes * camera.unproject(x + 0.5, y + 0.5, depth));
      }
    }
  }
  return bounds;
}

// Length of the solid along one ray, from its first hit to the rear; NaN = there is none.
struct Column {
  double truth = std::numeric_limits<double>::quiet_NaN();
  double mesh = std::numeric_limits<double>::quiet_NaN();
};

// Rays may begin inside the ground; only what they enter from outside is a surface seen.
bool enters(const PortalScene& scene, const RayHit& hit, const Ray& ray) {
  return face_normal(scene.mesh, hit.face).dot(ray.direction) < 0;
}

ObservedVolumeError summed(const std::vector<Column>& columns) {
  ObservedVolumeError error;
  int missed = 0;
  double truth = 0;
  double difference = 0;
  double deviation = 0;
  for (const auto& column : columns) {
    if (std::isnan(column.truth)) continue;
    ++error.rays;
    if (std::isnan(column.mesh)) {
      ++missed;
      continue;
    }
    truth += column.truth;
    difference += column.mesh - column.truth;
    deviation += std::abs(column.mesh - column.truth);
  }
  error.missed = error.rays > 0 ? static_cast<double>(missed) / error.rays : 1.0;
  error.relative_error = difference / truth;
  error.absolute_error = deviation / truth;
  return error;
}

}  // namespace

double depth_accuracy(const DepthMap& depth, const ViewTruth& truth, double tolerance) {
  require_same_size(depth, truth.depth);
  int64_t counted = 0;
  int64_t right = 0;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (truth.seen.data[i] < 2) continue;
    ++counted;
    const double ratio =
        static_cast<double>(depth.data[i]) / static_cast<double>(truth.depth.data[i]);
    if (std::abs(ratio - 1) <= tolerance) ++right;
  }
  if (counted == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(right) / static_cast<double>(counted);
}

double mask_iou(const MaskMap& a, const MaskMap& b) {
  require_same_size(a, b);
  int64_t both = 0;
  int64_t either = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    const bool in_a = a.data[i] != 0;
    const bool in_b = b.data[i] != 0;
    both += static_cast<int64_t>(in_a && in_b);
    either += static_cast<int64_t>(in_a || in_b);
  }
  return either == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(either);
}

MaskMap true_holes(const ViewTruth& truth) {
  MaskMap holes(truth.seen.width, truth.seen.height, 0);
  for (size_t i = 0; i < holes.data.size(); ++i) {
    holes.data[i] = static_cast<uint8_t>(truth.seen.data[i] == 0);
  }
  return holes;
}

ObservedVolumeError observed_volume_error(const PortalScene& scene,
                                          std::span<const Camera> inputs,
                                          const TriangleMesh& mesh,
                                          int grid) {
  require(grid >= 1, "grid must be >= 1", grid);
  require(inputs.size() >= 2, "at least two input views are needed", inputs.size());
  const Eigen::Matrix3d axes = mean_view_axes(inputs);
  const Eigen::AlignedBox3d bounds = observed_bounds(scene, inputs, axes);
  const Bvh bvh = build_bvh(mesh);
  // From the cameras on, so that what floats before the true surface is met.
  double front = bounds.min().z();
  for (const auto& camera : inputs) front = std::min(front, axes.row(2).dot(camera.center()));
  const double length = bounds.max().z() - front;
  const auto cells = static_cast<size_t>(grid);
  std::vector<Column> columns(cells * cells);
  tbb::parallel_for(size_t{0}, columns.size(), [&](size_t i) {
    const size_t row = i / cells;
    const size_t column = i % cells;
    Vector3d start = bounds.min();
    start.x() += bounds.sizes().x() * (static_cast<double>(column) + 0.5) / grid;
    start.y() += bounds.sizes().y() * (static_cast<double>(row) + 0.5) / grid;
    start.z() = front;
    const Ray ray{.origin = axes.transpose() * start, .direction = axes.row(2).transpose()};
    const auto truth = first_hit(scene.bvh, ray);
    if (!truth || !enters(scene, *truth, ray)) return;
    if (seen_by(scene.bvh, ray.origin + truth->t * ray.direction, inputs) < 2) return;
    columns[i].truth = length - truth->t;
    if (const auto hit = first_hit(bvh, ray)) columns[i].mesh = length - hit->t;
  });
  return summed(columns);
}

}  // namespace cgs
