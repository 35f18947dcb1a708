// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <vector>

#include "libcgs/priors/depth_layers.h"
#include "libcgs/train/trainer.h"
#include "tests/support/pane_scene.h"
#include "tests/support/stereo_scene.h"

namespace cgs::test {

struct PlantedScene {
  Scene scene;
  std::vector<DepthMap> truth;
  std::vector<ViewPriors> priors;
};

inline std::vector<TexturedPatch> wall_and_box() {
  std::vector<TexturedPatch> patches;
  patches.push_back({{0, 0, 1.0}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()});
  add_box(patches, {-0.15, -0.12, 0.7}, {0.15, 0.12, 0.9});
  return patches;
}

/// A textured wall with a box in front, seen by three cameras; its depth is known up to a smooth
/// bump of `error` relative height, another one in each view.
/// \param places  x of the cameras
inline PlantedScene planted_scene(double error,
                                  const std::vector<double>& places = {-0.12, 0.0, 0.12}) {
  const std::vector<TexturedPatch> patches = wall_and_box();
  std::vector<Camera> cameras;
  for (const double x : places) {
    cameras.push_back(looking_at({x, 0.03 * x, 0}, {0, 0, 0.9}, 72, 56, 70));
  }
  PlantedScene out;
  out.scene = photographed_scene(patches, cameras, 0.02);
  out.priors = true_priors(patches, cameras);
  for (size_t n = 0; n < cameras.size(); ++n) {
    ViewPriors& p = out.priors[n];
    out.truth.push_back(p.depth);
    for (float& s : p.sigma.data) s *= 2;
    for (int y = 0; y < p.depth.height; ++y) {
      for (int x = 0; x < p.depth.width; ++x) {
        const double bump = std::sin(0.09 * x + 2.0 * double(n)) * std::cos(0.11 * y + double(n));
        p.depth(x, y) *= static_cast<float>(1 + error * bump);
      }
    }
    p.layer = depth_layers(p.depth, {.count = 2, .sample_step = 2});
  }
  return out;
}

inline TrainingOptions short_training(int steps) {
  TrainingOptions options;
  options.steps = steps;
  options.coherence.depth_spacing = {32, 16};
  options.coherence.opacity_spacing = {16, 8};
  return options;
}

inline void run(Trainer& trainer) {
  while (!trainer.done()) trainer.step();
}

inline bool same_bits(const Gaussians& a, const Gaussians& b) {
  return a.position == b.position && a.scale == b.scale && a.rotation == b.rotation &&
         a.opacity == b.opacity && a.sh == b.sh;
}

}  // namespace cgs::test
