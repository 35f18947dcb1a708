// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/lanes.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Bounds of the depth at which the surface of a depth map may lie, over windows of pixels of
/// several sizes: the grid of each size is so fine that one value covers all around a place.
class DepthBounds {
 public:
  /// \param depth  [internal units], NaN where unknown
  /// \param hides  depth with its small gaps filled
  /// \param slack  largest z-distance at which a point that is seen in a pixel is still not free or
  ///               hidden [internal units]
  DepthBounds(const DepthMap& depth, const DepthMap& hides, const Raster<float>& slack);

  /// What the pixels of eight windows say.
  struct Lanes {
    Floats near;      ///< Points that are nearer are free, if they are seen in pixels with a depth,
    Floats far;       ///< points farther off hidden [internal units].
    Ints is_nothing;  ///< No pixel has a depth or hides anything.
    Ints is_partial;  ///< Some pixels have no depth.
  };
  /// Of all pixels at most `reach` from places within the picture [pixels].
  Lanes around(Floats u, Floats v, float reach) const;

 private:
  // Every 2^shift pixels, over windows of at least `reach` pixels to all sides. `near` is negative
  // (-0 too) where a pixel has no depth, `far` where there is nothing.
  struct Rung {
    int shift;
    float reach;
    Raster<float> near, far;
  };
  std::vector<Rung> rungs_;  // by reach
};

}  // namespace cgs
