// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/virtual_view.h"

#include <array>
#include <cmath>
#include <optional>

#include "libcgs/core/camera_between.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

// Depth of the nearest corresponding point in each pixel; 0 = none.
DepthMap nearest_points(const TrainingView& view,
                        std::span<const PixelMatch> matches,
                        const Camera& camera) {
  DepthMap out(camera.width, camera.height, 0);
  const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
  for (const PixelMatch& match : matches) {
    const int x = match.pixel % view.measured.width;
    const int y = match.pixel / view.measured.width;
    const Eigen::Vector3d point =
        view.camera.unproject(x + 0.5, y + 0.5, double(view.measured(x, y)));
    const Eigen::Vector3d uvz = camera.project_in_cam(cam_from_world * point);
    if (!camera.sees(uvz)) continue;
    float& nearest = out(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
    const auto z = static_cast<float>(uvz.z());
    if (nearest == 0 || z < nearest) nearest = z;
  }
  return out;
}

// Colour of a photograph where it shows a point, in camera axes, bilinear; nothing outside of it or
// in its mask.
std::optional<Eigen::Vector3f> color_of(const TrainingView& view,
                                        const Eigen::Vector3d& point_in_cam) {
  const Eigen::Vector3d uvz = view.camera.project_in_cam(point_in_cam);
  const double u = uvz.x() - 0.5;
  const double v = uvz.y() - 0.5;
  const bool is_inside =
      uvz.z() > 0 && u >= 0 && v >= 0 && u < view.camera.width - 1 && v < view.camera.height - 1;
  if (!is_inside) return {};
  const auto x = static_cast<int>(u);
  const auto y = static_cast<int>(v);
  const auto a = static_cast<float>(u - x);
  const auto b = static_cast<float>(v - y);
  const std::array<float, 4> weight = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
  Eigen::Vector3f out = Eigen::Vector3f::Zero();
  for (int k = 0; k < 4; ++k) {
    const size_t i = view.photograph[0].index(x + k % 2, y + k / 2);
    if (!view.use.empty() && view.use.data[i] == 0) return {};
    for (int c = 0; c < 3; ++c) out[c] += weight[k] * view.photograph[c].data[i];
  }
  return out;
}

}  // namespace

VirtualView virtual_view(const TrainingView& first,
                         const TrainingView& second,
                         std::span<const PixelMatch> matches,
                         double share) {
  constexpr float kMostDifference = 0.1f;
  require(share >= 0 && share <= 1, "virtual_view: share must be in [0, 1]", share);
  VirtualView out{camera_between(first.camera, second.camera, share), {}, {}};
  const int width = out.camera.width;
  const int height = out.camera.height;
  for (Raster<float>& plane : out.photograph) plane = Raster<float>(width, height, 0);
  out.use = MaskMap(width, height, 0);
  const DepthMap depth = nearest_points(first, matches, out.camera);
  const Eigen::Isometry3d first_from_world = first.camera.cam_from_world();
  const Eigen::Isometry3d second_from_world = second.camera.cam_from_world();
  const auto part = static_cast<float>(share);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (depth(x, y) == 0) continue;
      const Eigen::Vector3d point = out.camera.unproject(x + 0.5, y + 0.5, double(depth(x, y)));
      const auto a = color_of(first, first_from_world * point);
      const auto b = color_of(second, second_from_world * point);
      if (!a || !b || (*a - *b).cwiseAbs().mean() > kMostDifference) continue;
      out.use(x, y) = 1;
      for (int c = 0; c < 3; ++c) out.photograph[c](x, y) = (1 - part) * (*a)[c] + part * (*b)[c];
    }
  }
  return out;
}

}  // namespace cgs
