// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/virtual_cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

constexpr double kFieldOfView = 50 * std::numbers::pi / 180;
constexpr float kOpaque = 0.1f;

/// The part of the splats that matters.
struct Ball {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0;
  Eigen::AlignedBox3d inner;     // of the middle nine tenths along each axis: within the walls
  std::vector<uint32_t> splats;  // opaque ones within it
};

Ball ball_around(const Gaussians& g) {
  std::vector<uint32_t> opaque;
  for (uint32_t i = 0; i < g.size(); ++i) {
    if (g.opacity[i] >= kOpaque) opaque.push_back(i);
  }
  if (opaque.empty()) {
    for (uint32_t i = 0; i < g.size(); ++i) opaque.push_back(i);
  }
  Ball out;
  std::vector<double> values(opaque.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(opaque.begin(), opaque.end(), values.begin(), [&](uint32_t i) {
      return double{g.position[i][axis]};
    });
    out.center[axis] = quantile(values, 0.5);
    out.inner.min()[axis] = quantile(values, 0.05);
    out.inner.max()[axis] = quantile(values, 0.95);
  }
  const auto distance = [&](uint32_t i) {
    return (g.position[i].cast<double>() - out.center).norm();
  };
  std::transform(opaque.begin(), opaque.end(), values.begin(), distance);
  constexpr double kInner = 0.98;
  out.radius = quantile(values, kInner);
  // A single splat, or all in one place, still has a size.
  std::transform(opaque.begin(), opaque.end(), values.begin(), [&](uint32_t i) {
    return double{g.scale[i].maxCoeff()};
  });
  out.radius += 2 * quantile(values, 0.5);
  for (const uint32_t i : opaque) {
    if (distance(i) <= out.radius) out.splats.push_back(i);
  }
  return out;
}

Camera camera_towards(const Eigen::Vector3d& eye,
                      const Eigen::Vector3d& forward,
                      double field_of_view,
                      int size) {
  Camera camera;
  camera.width = camera.height = size;
  camera.fx = camera.fy = 0.5 * size / std::tan(0.5 * field_of_view);
  camera.cx = camera.cy = 0.5 * size;
  const Eigen::Vector3d z = forward.normalized();
  const Eigen::Vector3d helper =
      std::abs(z.y()) < 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d x = helper.cross(z).normalized();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  camera.world_from_cam.linear() = R;
  camera.world_from_cam.translation() = eye;
  return camera;
}

std::vector<Camera> cameras_outside(const Ball& ball, int views, int size) {
  // The corners of the box around the ball must be seen, too: what nobody sees may be solid.
  const double distance = std::sqrt(2.0) * ball.radius / std::sin(0.5 * kFieldOfView);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Camera> out;
  for (int i = 0; i < views; ++i) {
    const double y = 1 - (2 * i + 1.0) / views;
    const double r = std::sqrt(1 - y * y);
    const Eigen::Vector3d direction(r * std::cos(golden * i), y, r * std::sin(golden * i));
    out.push_back(
        camera_towards(ball.center + distance * direction, -direction, kFieldOfView, size));
  }
  return out;
}

/// Places that keep away from every splat, the freest first, each far from those before it.
std::vector<Eigen::Vector3d> free_places(const Gaussians& g, const Ball& ball, size_t count) {
  constexpr int kSteps = 9;  // of the grid along an axis
  constexpr size_t kMostSamples = 20'000;
  std::vector<Eigen::Vector3d> grid;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    const Eigen::Vector3i step(i % kSteps, i / kSteps % kSteps, i / kSteps / kSteps);
    const Eigen::Vector3d part = (step.cast<double>().array() + 0.5) / kSteps;
    grid.emplace_back(ball.inner.min() + part.cwiseProduct(ball.inner.sizes()));
  }
  std::vector<double> clearance(grid.size(), std::numeric_limits<double>::max());
  const size_t stride = 1 + ball.splats.size() / kMostSamples;
  tbb::parallel_for(size_t{0}, grid.size(), [&](size_t k) {
    for (size_t i = 0; i < ball.splats.size(); i += stride) {
      const Eigen::Vector3d p = g.position[ball.splats[i]].cast<double>();
      clearance[k] = std::min(clearance[k], (p - grid[k]).norm());
    }
  });
  std::vector<Eigen::Vector3d> out;
  while (out.size() < count) {
    const auto best = std::max_element(clearance.begin(), clearance.end());
    if (!(*best > 0)) break;
    out.push_back(grid[static_cast<size_t>(best - clearance.begin())]);
    for (size_t k = 0; k < grid.size(); ++k) {
      clearance[k] = std::min(clearance[k], 0.5 * (grid[k] - out.back()).norm());
    }
  }
  return out;
}

std::vector<Camera> cameras_inside(const Gaussians& g, const Ball& ball, int views, int size) {
  constexpr std::array<std::array<int, 3>, 6> kFaces = {
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  const size_t places = (static_cast<size_t>(views) + kFaces.size() - 1) / kFaces.size();
  std::vector<Camera> out;
  for (const Eigen::Vector3d& place : free_places(g, ball, places)) {
    for (const auto& [x, y, z] : kFaces) {
      const Eigen::Vector3d forward(x, y, z);
      out.push_back(camera_towards(place, forward, 0.5 * std::numbers::pi, size));
    }
  }
  return out;
}

/// The fraction of the opaque splats that lie on the surface some small picture shows.
double coverage_of(const Gaussians& g, const Ball& ball, const std::vector<Camera>& cameras) {
  constexpr int kSmall = 160;
  std::vector<uint8_t> seen(ball.splats.size(), 0);
  for (const Camera& camera : cameras) {
    const Camera small = resized(camera, kSmall, kSmall);
    const DepthMap depth = rasterize(g, small).median_depth;
    const Eigen::Isometry3d cam_from_world = small.cam_from_world();
    tbb::parallel_for(size_t{0}, seen.size(), [&](size_t k) {
      const uint32_t i = ball.splats[k];
      const Eigen::Vector3d uvz =
          small.project_in_cam(cam_from_world * g.position[i].cast<double>());
      if (!small.sees(uvz)) return;
      const double surface = depth(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
      const double slack = 0.02 * ball.radius + 2 * g.scale[i].maxCoeff();
      if (std::abs(uvz.z() - surface) <= slack) seen[k] = 1;
    });
  }
  const auto count = std::count(seen.begin(), seen.end(), uint8_t{1});
  return static_cast<double>(count) / static_cast<double>(seen.size());
}

}  // namespace

void VirtualCameraOptions::validate() const {
  require(views >= 4 && views <= 512, "VirtualCameraOptions.views must be in [4, 512]", views);
  require(size >= 64 && size <= 4096, "VirtualCameraOptions.size must be in [64, 4096]", size);
}

VirtualCameras virtual_cameras(const Gaussians& gaussians,
                               const VirtualCameraOptions& options,
                               const Progress& progress) {
  options.validate();
  require(gaussians.size() > 0, "virtual_cameras: number of Gaussians must be > 0", 0);
  constexpr double kClearly = 0.1;
  const Ball ball = ball_around(gaussians);
  VirtualCameras out;
  out.center = ball.center;
  out.radius = ball.radius;
  std::vector<Camera> inside;
  if (options.placement != VirtualPlacement::Inside) {
    out.cameras = cameras_outside(ball, options.views, options.size);
    out.coverage = coverage_of(gaussians, ball, out.cameras);
  }
  report(progress, 0.5);
  if (options.placement != VirtualPlacement::Outside) {
    inside = cameras_inside(gaussians, ball, options.views, options.size);
    const double coverage = inside.empty() ? -1 : coverage_of(gaussians, ball, inside);
    const bool forced = options.placement == VirtualPlacement::Inside;
    require(!forced || !inside.empty(), "no free place among the splats; places found", 0);
    out.inside = forced || coverage > out.coverage + kClearly;
    out.coverage_of_other_placement = forced ? -1 : out.inside ? out.coverage : coverage;
    if (out.inside) out.coverage = coverage;
  }
  if (out.inside) out.cameras = std::move(inside);
  report(progress, 1);
  return out;
}

}  // namespace cgs
