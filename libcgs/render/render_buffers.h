// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "libcgs/core/hole.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Everything one forward pass of the rasterizer gives for one camera. w_i is the blending weight
/// of Gaussian i at the pixel, z_i the z-depth of its centre.
struct RenderBuffers {
  ColorImage color;       ///< Sum w_i c_i + (1 - alpha) * background, not clamped above.
  Raster<float> alpha;    ///< Sum w_i
  DepthMap depth;         ///< Sum w_i z_i / alpha; NaN where alpha is below min_alpha.
  DepthMap median_depth;  ///< z_i where transmittance falls through 0.5; NaN if it never does.
  Raster<float> depth_variance;  ///< Sum w_i z_i^2 / alpha - depth^2, >= 0; 0 where depth is NaN.
  Raster<float> weight_squared;  ///< Sum w_i^2
  Raster<uint32_t> strongest;    ///< Index of the Gaussian of largest w_i; UINT32_MAX = none.
  // Filled by annotate_support():
  Raster<uint8_t> support;  ///< Number of input views that see the surface drawn here.
  Raster<Hole> hole;
};

}  // namespace cgs
