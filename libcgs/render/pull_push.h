// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/raster.h"

namespace cgs {

/// Colours of one size of the picture, and how much is known of each: 0 to 1.
struct PulledLevel {
  ColorImage color;
  Raster<float> weight;
  DepthMap depth;  // where the weight is above 0

  PulledLevel(int width, int height)
      : color(width, height, Eigen::Vector3f::Zero()),
        weight(width, height, 0),
        depth(width, height, 0) {}
};

/// A picture with what lies around its gaps drawn into them, and its depth likewise: means of ever
/// coarser levels, in which the far side counts more as long as gaps are narrow. What nothing is
/// known of anywhere keeps weight 0.
///
/// \param narrow  number of halvings within which a gap is one behind an edge, so that the far side
///                goes on in it
/// Source: pull and push, Gortler et al. 1996, "The Lumigraph", 3.4, here with weights by depth.
PulledLevel pulled_and_pushed(PulledLevel finest, size_t narrow);

}  // namespace cgs
