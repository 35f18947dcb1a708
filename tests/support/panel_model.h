// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <string>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/reconstruct/model.h"

namespace cgs::test {

inline constexpr double kPanel = 3;        ///< Depth of the panel.
inline constexpr double kPanelHalf = 0.6;  ///< Half of its width; it is as high as all pictures.
inline constexpr double kBackWall = 5;     ///< Depth of the wall behind it.

/// What stands on a ray from (x, 0, 0) whose direction has z = 1: the panel, or the wall.
inline double panel_depth(double x, const Eigen::Vector3d& direction) {
  return std::abs(x + kPanel * direction.x()) < kPanelHalf ? kPanel : kBackWall;
}

inline Eigen::Vector3f panel_color(double x, double y, double z) {
  if (z < kBackWall) return {0.8f, 0.2f, 0.2f};
  return {static_cast<float>(0.5 + 0.1 * x), 0.4f, static_cast<float>(0.4 + 0.05 * y)};
}

/// The camera of the row that stands at (x, 0, 0) and looks along +z.
inline Camera panel_camera(double x) {
  Camera out{96, 64, 90, 90, 48, 32, Eigen::Isometry3d::Identity()};
  out.world_from_cam.translation().x() = x;
  return out;
}

/// Three input views that look at a panel before a wall, measured by all, an opaque Gaussian for
/// each of their pixels. From aside one sees wall that the panel hid from all of them.
inline Model panel_model() {
  Model out;
  for (const double at : {-0.2, 0.0, 0.2}) {
    View view;
    view.name = "v" + std::to_string(out.scene.views.size());
    view.camera = panel_camera(at);
    const int w = view.camera.width;
    const int h = view.camera.height;
    view.image = ColorImage(w, h, Eigen::Vector3f::Zero());
    ViewPriors priors;
    priors.depth = DepthMap(w, h, 0);
    priors.sigma = DepthMap(w, h, 0.003f);
    priors.confidence = Raster<float>(w, h, 1);
    priors.origin = Raster<DepthOrigin>(w, h, DepthOrigin::Measured);
    priors.layer = Raster<uint8_t>(w, h, 0);
    priors.matched_views = Raster<uint8_t>(w, h, 2);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const Eigen::Vector3d ray = view.camera.ray_in_cam(x + 0.5, y + 0.5);
        const double z = panel_depth(at, ray);
        priors.depth(x, y) = static_cast<float>(z);
        view.image(x, y) = panel_color(at + z * ray.x(), z * ray.y(), z);
      }
    }
    out.scene.input.push_back(static_cast<int>(out.scene.views.size()));
    out.scene.views.push_back(view);
    out.priors.push_back(priors);
  }
  out.scene.frame.up = -Eigen::Vector3d::UnitY();
  out.gaussians = initial_gaussians(out.scene, out.priors, {.opacity = 0.95f});
  return out;
}

}  // namespace cgs::test
