// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "libcgs/core/srgb.h"
#include "libcgs/priors/view_priors.h"
#include "tests/support/stereo_scene.h"

namespace cgs::test {

/// A wall in many colours with a square before it, photographed from three places, and its true
/// depth as if all of it had been measured.
struct ColoredWall {
  std::vector<TexturedPatch> patches = {
      {Eigen::Vector3d(0, 0, 6), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()},
      {Eigen::Vector3d(0, 0, 3), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 0.5, 0.5}};
  Scene scene;
  std::vector<ViewPriors> priors;

  ColoredWall() {
    std::vector<Camera> cameras;
    for (const double x : {-0.6, 0.0, 0.6}) {
      cameras.push_back(looking_at({x, 0.2 * x, 0}, {0, 0, 6}, 160, 120, 130));
    }
    constexpr std::array<double, 3> kCells = {0.2, 0.27, 0.36};  // another pattern per channel
    for (size_t c = 0; c < 3; ++c) {
      Scene channel = photographed_scene(patches, cameras, kCells.at(c));
      if (c == 0) scene = channel;
      for (size_t v = 0; v < 3; ++v) {
        for (size_t i = 0; i < scene.views[v].image.data.size(); ++i) {
          const float level = channel.views[v].image.data[i].x();
          scene.views[v].image.data[i][static_cast<Eigen::Index>(c)] = level;
        }
      }
    }
    for (const View& view : scene.views) {
      ViewPriors& out = priors.emplace_back();
      out.depth = true_depth(patches, view.camera);
      out.origin = Raster<DepthOrigin>(160, 120, DepthOrigin::Measured);
    }
  }
};

/// A photograph as a print of that response shows it, of 8 bits: for pictures of linear light l,
/// (gain l falling off by `falls` in the corners)^gamma. Independent of what corrects it.
inline void print(ColorImage& image, const Eigen::Vector3d& gain, double gamma, double falls) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double dx = (x + 0.5) / image.width - 0.5;
      const double dy = (y + 0.5) / image.height - 0.5;
      const double w = image.width;
      const double h = image.height;
      const double r2 = 4 * (dx * dx * w * w + dy * dy * h * h) / (w * w + h * h);
      for (int c = 0; c < 3; ++c) {
        const double light = double{linear_from_srgb(image(x, y)[c])} * gain[c] * (1 - falls * r2);
        const float coded = srgb_from_linear(static_cast<float>(std::pow(light, gamma)));
        image(x, y)[c] = std::round(std::min(coded, 1.0f) * 255) / 255;
      }
    }
  }
}

}  // namespace cgs::test
