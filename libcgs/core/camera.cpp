// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/camera.h"

#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

namespace cgs {

Eigen::Matrix3d Camera::intrinsics() const {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = fx;
  K(1, 1) = fy;
  K(0, 2) = cx;
  K(1, 2) = cy;
  return K;
}

Camera resized(const Camera& camera, int width, int height) {
  const double sx = static_cast<double>(width) / camera.width;
  const double sy = static_cast<double>(height) / camera.height;
  Camera out = camera;
  out.width = width;
  out.height = height;
  out.fx *= sx;
  out.cx *= sx;
  out.fy *= sy;
  out.cy *= sy;
  return out;
}

namespace {

// Directions as ray_in_cam() gives them, of every column and row of pixels.
struct Rays {
  explicit Rays(const Camera& camera) {
    for (int x = 0; x < camera.width; ++x) across.push_back(camera.ray_in_cam(x + 0.5, 0).x());
    for (int y = 0; y < camera.height; ++y) down.push_back(camera.ray_in_cam(0, y + 0.5).y());
  }
  std::vector<double> across, down;
};

// Difference of the unprojected points before and after p along one axis. Of a one-sided and a
// central difference the one with the smaller depth step is taken, so that normals at an
// occlusion edge belong to the surface of the pixel and not to the jump.
Eigen::Vector3d tangent(const DepthMap& depth,
                        const Rays& rays,
                        const Eigen::Vector2i& pixel,
                        const Eigen::Vector2i& step) {
  const int x = pixel.x();
  const int y = pixel.y();
  const int dx = step.x();
  const int dy = step.y();
  const auto depth_at = [&](int u, int v) {
    return depth.contains(u, v) ? depth(u, v) : std::nanf("");
  };
  const auto point = [&](int u, int v) {
    const Eigen::Vector3d ray(rays.across[size_t(u)], rays.down[size_t(v)], 1);
    return Eigen::Vector3d(double(depth(u, v)) * ray);
  };
  const float here = depth(x, y);
  const float step_before = std::abs(depth_at(x - dx, y - dy) - here);
  const float step_after = std::abs(depth_at(x + dx, y + dy) - here);
  const bool before = std::isfinite(step_before);
  const bool after = std::isfinite(step_after);
  if (!before && !after) return Eigen::Vector3d::Zero();
  constexpr float kEdgeRatio = 3.0f;
  if (before && after && step_before <= kEdgeRatio * step_after + 1e-6f * here &&
      step_after <= kEdgeRatio * step_before + 1e-6f * here) {
    return point(x + dx, y + dy) - point(x - dx, y - dy);
  }
  if (!after || (before && step_before < step_after)) return point(x, y) - point(x - dx, y - dy);
  return point(x + dx, y + dy) - point(x, y);
}

}  // namespace

NormalMap normals_from_depth(const DepthMap& depth, const Camera& camera) {
  NormalMap normals(depth.width, depth.height, Eigen::Vector3f::Zero());
  const Eigen::Matrix3d R = camera.world_from_cam.rotation();
  const Rays rays(camera);
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      if (!std::isfinite(depth(x, y))) continue;
      const Eigen::Vector3d n =
          tangent(depth, rays, {x, y}, {0, 1}).cross(tangent(depth, rays, {x, y}, {1, 0}));
      const double length = n.norm();
      if (length > 0) normals(x, y) = (R * (n / length)).cast<float>();
    }
  });
  return normals;
}

}  // namespace cgs
