// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "libcgs/priors/view_priors.h"

namespace cgs::test {

/// Of a view of which nothing is known.
inline ViewPriors unmeasured_priors(int width, int height) {
  const float unknown = std::nanf("");
  return {DepthMap(width, height, unknown),
          DepthMap(width, height, unknown),
          Raster<float>(width, height, 0.0f),
          Raster<DepthOrigin>(width, height, DepthOrigin::Unknown),
          Raster<uint8_t>(width, height, 0),
          Raster<uint8_t>(width, height, 0)};
}

}  // namespace cgs::test
