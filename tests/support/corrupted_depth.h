// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "libcgs/core/raster.h"

namespace cgs::test {

/// What a bad network makes of true depth: another scale and offset in each view, smooth bumps, and
/// one square of 24 x 24 pixels turned inside out. Depth is some 1.
struct Corruption {
  double bumps = 0.2;                    ///< Relative height.
  int inverted_x = -1, inverted_y = -1;  ///< Corner of the square; negative = none.
  bool disparity = false;
};

inline bool is_inverted(const Corruption& how, int x, int y) {
  constexpr int kEdge = 24;
  return how.inverted_x >= 0 && x >= how.inverted_x && x < how.inverted_x + kEdge &&
         y >= how.inverted_y && y < how.inverted_y + kEdge;
}

inline DepthMap corrupted_depth(const DepthMap& truth, unsigned view, const Corruption& how) {
  DepthMap out(truth.width, truth.height, std::nanf(""));
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      const double bump = std::sin(0.05 * x + view) * std::cos(0.06 * y + 2.0 * view);
      double z = double(truth(x, y)) * (1 + how.bumps * bump);
      if (is_inverted(how, x, y)) z = 1 / z;
      const double value = how.disparity ? 1 / z : z;
      out(x, y) = static_cast<float>((3.0 + view) * value + 0.7 * view);
    }
  }
  return out;
}

}  // namespace cgs::test
