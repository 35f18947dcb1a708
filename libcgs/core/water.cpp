// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/water.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

/// A depth and how far from its pixel it was measured [pixels, in steps].
struct CarriedDepth {
  float depth = 0;
  float way = INFINITY;
};

void take_if_nearer(const Raster<CarriedDepth>& from, int x, int y, float step, CarriedDepth& out) {
  if (!from.contains(x, y)) return;
  const CarriedDepth& other = from(x, y);
  if (other.way + step < out.way) out = {other.depth, other.way + step};
}

// Depth of the nearest pixel that has one, by steps to the eight neighbours; 0 where none has.
// Source: Borgefors 1986, "Distance transformations in digital images".
DepthMap completed_by_nearest(const DepthMap& depth) {
  constexpr float kDiagonal = 1.41421356f;
  constexpr std::array<std::pair<int, int>, 4> kBefore = {{{-1, 0}, {0, -1}, {-1, -1}, {1, -1}}};
  Raster<CarriedDepth> carried(depth.width, depth.height, {});
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (std::isfinite(depth.data[i])) carried.data[i] = {depth.data[i], 0};
  }
  for (const int sign : {1, -1}) {
    for (int row = 0; row < depth.height; ++row) {
      for (int column = 0; column < depth.width; ++column) {
        const int x = sign > 0 ? column : depth.width - 1 - column;
        const int y = sign > 0 ? row : depth.height - 1 - row;
        for (const auto& [dx, dy] : kBefore) {
          const float step = dx != 0 && dy != 0 ? kDiagonal : 1.0f;
          take_if_nearer(carried, x + sign * dx, y + sign * dy, step, carried(x, y));
        }
      }
    }
  }
  DepthMap out(depth.width, depth.height, 0);
  std::transform(carried.data.begin(), carried.data.end(), out.data.begin(), [](const auto& c) {
    return c.depth;
  });
  return out;
}

// Every pixel by itself: `change` has its linear light and its range.
template <typename Change>
ColorImage changed_light(const ColorImage& image,
                         const Camera& camera,
                         const DepthMap& depth,
                         const Change& change) {
  require(depth.width == image.width && depth.height == image.height,
          "depth of water must have the size of the picture",
          depth.width);
  const DepthMap known = completed_by_nearest(depth);
  ColorImage out = image;
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const double z = known(x, y);
      if (!(z > 0)) continue;
      const double range = z * camera.ray_in_cam(x + 0.5, y + 0.5).norm();
      const Eigen::Vector3f light = image(x, y).unaryExpr(&linear_from_srgb);
      const Eigen::Vector3d changed = change(light.cast<double>(), range);
      out(x, y) = changed.cwiseMax(0.0).cwiseMin(1.0).cast<float>().unaryExpr(&srgb_from_linear);
    }
  });
  return out;
}

}  // namespace

Eigen::Vector3d Water::transmission(double range) const {
  const double falloff = lamp_range > 0 ? lamp_range / range : 1;
  return falloff * falloff * (-range * attenuation.array()).exp();
}

Eigen::Vector3d Water::haze(double range) const {
  return veil.array() * (1 - (-range * backscatter.array()).exp());
}

ColorImage without_water(const ColorImage& photograph,
                         const Camera& camera,
                         const DepthMap& depth,
                         const Water& water) {
  constexpr double kLeastLeft = 0.02;
  const auto cleared = [&](const Eigen::Vector3d& light, double range) -> Eigen::Vector3d {
    const Eigen::Vector3d left = water.transmission(range).cwiseMax(kLeastLeft);
    return (light - water.haze(range)).cwiseQuotient(left);
  };
  return changed_light(photograph, camera, depth, cleared);
}

ColorImage through_water(const ColorImage& picture,
                         const Camera& camera,
                         const DepthMap& depth,
                         const Water& water) {
  const auto dimmed = [&](const Eigen::Vector3d& light, double range) -> Eigen::Vector3d {
    return light.cwiseProduct(water.transmission(range)) + water.haze(range);
  };
  return changed_light(picture, camera, depth, dimmed);
}

}  // namespace cgs
