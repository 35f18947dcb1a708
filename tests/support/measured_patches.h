// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "libcgs/core/split_mix.h"
#include "tests/support/stereo_scene.h"
#include "tests/support/unmeasured_priors.h"

namespace cgs::test {

/// Patches photographed by two cameras, one a metre before the other, +y of the world down, that
/// look along +z; and their true depth with noise, as it was measured of some of it.
struct MeasuredPatches {
  static constexpr int kWidth = 120;
  static constexpr int kHeight = 90;

  std::vector<TexturedPatch> patches;
  Scene scene;
  std::vector<DepthMap> truth;
  std::vector<ViewPriors> priors;

  /// \param noise  standard deviation of the depth, relative to it
  explicit MeasuredPatches(std::vector<TexturedPatch> photographed, double noise = 0.003)
      : patches(std::move(photographed)) {
    std::vector<Camera> cameras;
    for (const double z : {0.0, 1.0}) {
      cameras.push_back(looking_at({0, 0, z}, {0, 0, z + 1}, kWidth, kHeight, 80));
    }
    scene = photographed_scene(patches, cameras, 1);
    scene.frame.up = -Eigen::Vector3d::UnitY();
    for (const Camera& camera : cameras) {
      truth.push_back(true_depth(patches, camera));
      priors.push_back(unmeasured_priors(kWidth, kHeight));
      measure(priors.back(), truth.back(), noise);
    }
  }

  /// Leaves measured only what of this (x, y, true depth) holds; the sky is found as such.
  void keep(const std::function<bool(int, int, float)>& is_measured) {
    for (size_t v = 0; v < priors.size(); ++v) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          if (is_measured(x, y, truth[v](x, y))) continue;
          const bool is_sky = std::isnan(truth[v](x, y));
          priors[v].origin(x, y) = is_sky ? DepthOrigin::Sky : DepthOrigin::Unknown;
          priors[v].depth(x, y) = priors[v].sigma(x, y) = std::nanf("");
        }
      }
    }
  }

 private:
  static void measure(ViewPriors& priors, const DepthMap& truth, double noise) {
    for (size_t i = 0; i < truth.data.size(); ++i) {
      if (std::isnan(truth.data[i])) continue;
      double error = 0;  // about normal
      for (uint64_t k = 0; k < 12; ++k) error += double(random_number(12 * i + k)) / 0x1p64 - 0.5;
      priors.depth.data[i] = static_cast<float>(double{truth.data[i]} * (1 + noise * error));
      priors.sigma.data[i] = static_cast<float>(double{truth.data[i]} * noise);
      priors.origin.data[i] = DepthOrigin::Measured;
    }
  }
};

/// Ground 1.5 below the cameras between walls 2 to the left and 3 to the right of them, 30 long.
inline std::vector<TexturedPatch> street() {
  using Eigen::Vector3d;
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  return {{Vector3d(0.5, 1.5, 10), x, z, 2.5, 20},
          {Vector3d(-2, -1, 10), y, z, 2.5, 20},
          {Vector3d(3, -1, 10), y, z, 2.5, 20}};
}

}  // namespace cgs::test
