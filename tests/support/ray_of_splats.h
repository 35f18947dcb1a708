// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs::test {

/// Of 3 x 3 pixels, looking along z.
inline Camera camera_of_ray() {
  return {.width = 3, .height = 3, .fx = 3, .fy = 3, .cx = 1.5, .cy = 1.5};
}

/// Balls of one colour that cover all pixels of camera_of_ray(), one behind the other.
inline Gaussians ray_of_splats(const std::vector<float>& depths,
                               const std::vector<float>& opacity) {
  Gaussians out;
  for (size_t i = 0; i < depths.size(); ++i) {
    out.position.emplace_back(0.0f, 0.0f, depths[i]);
    out.scale.push_back(Eigen::Vector3f::Constant(5));
    out.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
    out.opacity.push_back(opacity[i]);
    out.sh.push_back(Eigen::Vector3f::Zero());
  }
  return out;
}

/// 400 steps down the gradient of a term on what camera_of_ray() sees, each of a fixed length in
/// the logit of every opacity, falling along the way.
inline void descend_on_opacities(
    Gaussians& splats,
    const TrainingRasterizerOptions& options,
    const std::function<void(const TrainingBuffers&, TrainingBuffers&)>& term) {
  TrainingRasterizer rasterizer(options);
  for (int step = 0; step < 400; ++step) {
    const TrainingBuffers& drawn = rasterizer.forward(splats, camera_of_ray());
    TrainingBuffers loss;
    term(drawn, loss);
    GaussianGradients gradient;
    rasterizer.backward(loss, gradient);
    const float length = 0.05f * (1 - float(step) / 400);
    for (size_t i = 0; i < splats.size(); ++i) {
      const float slope = gradient.opacity[i];
      const float sign = static_cast<float>(slope > 0) - static_cast<float>(slope < 0);
      const float logit = std::log(splats.opacity[i] / (1 - splats.opacity[i])) - length * sign;
      splats.opacity[i] = std::clamp(1 / (1 + std::exp(-logit)), 0.005f, 0.98f);
    }
  }
}

}  // namespace cgs::test
