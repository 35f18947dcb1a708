// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

inline Camera stacked_camera(int view) {
  Camera camera{.width = 504, .height = 378, .fx = 420, .fy = 420, .cx = 252, .cy = 189};
  camera.world_from_cam.translation().x() = 0.01 * view;
  return camera;
}

// Isotropic Gaussians of 0.6 pixels and opacity 0.5 on a gently waved surface, view-major.
inline Gaussians stacked_views() {
  Gaussians g;
  for (int view = 0; view < 3; ++view) {
    const Camera camera = stacked_camera(view);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double z = 0.7 + 0.05 * std::sin(0.02 * x) * std::cos(0.03 * y);
        g.position.push_back(camera.unproject(x + 0.5, y + 0.5, z).cast<float>());
        g.scale.push_back(Eigen::Vector3f::Constant(float(0.6 * z / camera.fx)));
        g.rotation.emplace_back(1, 0, 0, 0);
        g.opacity.push_back(0.5f);
        g.sh.emplace_back(float(x) / 504, float(y) / 378, 0.2f);
      }
    }
  }
  return g;
}

// The same, stretched and turned.
inline Gaussians needles() {
  Gaussians g = stacked_views();
  for (size_t i = 0; i < g.size(); ++i) {
    g.scale[i].x() *= 1.5f;
    g.scale[i].z() *= 0.5f;
    g.rotation[i] = Eigen::Vector4f(1, 0.3f, float(i % 7) - 3, 0.2f).normalized();
  }
  return g;
}

}  // namespace cgs
