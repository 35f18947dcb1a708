// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"

namespace cgs {

/// How a depth map is cut into layers.
struct DepthLayersOptions {
  int count = 5;         ///< In [1, 255].
  int sample_step = 10;  ///< Every so many pixels along both axes are clustered; >= 1. More
                         ///< than one where that would be above 10,000.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Layer of every pixel, 0 = farthest, by Ward clustering of sampled inverse depths.
///
/// In one dimension Ward's method only ever merges neighbours in sorted order, so it is a greedy
/// merge of adjacent runs with cost n_a n_b / (n_a + n_b) (mean_a - mean_b)^2. A layer begins at
/// its smallest sample; everything farther than all samples is layer 0, and so is unknown depth.
/// Maps with fewer distinct depths than layers use the lowest numbers.
Raster<uint8_t> depth_layers(const DepthMap& depth, const DepthLayersOptions& options);

}  // namespace cgs
