// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include "libcgs/core/lanes.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// The values of a raster with a margin around them, as long as eight lanes may reach to the right.
inline Raster<float> with_margin(const Raster<float>& raster,
                                 int margin,
                                 float fill = std::numeric_limits<float>::quiet_NaN()) {
  Raster<float> out(raster.width + 2 * margin + kLanes, raster.height + 2 * margin, fill);
  for (int y = 0; y < raster.height; ++y) {
    const auto row = raster.data.begin() + std::ptrdiff_t(raster.index(0, y));
    std::copy(row, row + raster.width, &out(margin, y + margin));
  }
  return out;
}

}  // namespace cgs
