// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/raster.h"

namespace cgs {

/// How the depth of a pixel became known.
enum class DepthOrigin : uint8_t {
  Unknown = 0,    ///< No depth at all (masked out).
  Measured = 1,   ///< Matched in at least one other view and confirmed from there, or measured by
                  ///< a depth sensor (then possibly with no matched view).
  Completed = 2,  ///< Filled in from measured neighbours; no evidence of its own.
  Guessed = 3,    ///< By a given depth that rests on this photograph alone, such as a network's,
                  ///< fitted to the measured pixels.
};

/// What is known about one input view before training; every raster has the size of its image.
struct ViewPriors {
  DepthMap depth;              ///< z-depth [internal units]; NaN exactly where origin is Unknown.
  DepthMap sigma;              ///< Standard deviation of depth [internal units]; NaN as depth.
  Raster<float> confidence;    ///< In [0, 1]; completed pixels keep the low value they had.
  Raster<DepthOrigin> origin;  ///< See DepthOrigin.
  Raster<uint8_t> layer;       ///< Depth layer, 0 = farthest … layer_count - 1 = nearest.
  Raster<uint8_t> matched_views;  ///< Number of other input views that confirm the depth.
};

}  // namespace cgs
