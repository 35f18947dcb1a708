// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

#include "libcgs/core/raster.h"

namespace cgs {

/// Colour at a point of an image [pixels, centres at +0.5], bilinear; borders are repeated.
inline Eigen::Vector3f color_at(const ColorImage& image, float u, float v) {
  const auto x = static_cast<int>(std::floor(u - 0.5f));
  const auto y = static_cast<int>(std::floor(v - 0.5f));
  const float a = u - 0.5f - static_cast<float>(x);
  const float b = v - 0.5f - static_cast<float>(y);
  const auto at = [&](int i, int j) -> const Eigen::Vector3f& {
    return image(std::clamp(i, 0, image.width - 1), std::clamp(j, 0, image.height - 1));
  };
  return (1 - b) * ((1 - a) * at(x, y) + a * at(x + 1, y)) +
         b * ((1 - a) * at(x, y + 1) + a * at(x + 1, y + 1));
}

}  // namespace cgs
