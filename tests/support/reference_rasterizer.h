// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/raster.h"

namespace cgs::test {

/// What the reference computes, in double.
struct ReferenceImage {
  Raster<Eigen::Vector3d> color;
  Raster<double> alpha;
  Raster<double> depth;         ///< Sum w z / alpha, wherever alpha > 0.
  Raster<double> median_depth;  ///< NaN if transmittance never falls through 0.5.
  Raster<double> depth_variance;
  Raster<double> weight_squared;
  Raster<uint32_t> strongest;
  /// How much the pixel may change because some alpha lies so near 1/255 (or some T so near 1e-4)
  /// that float rounding may decide the other way: the sum of the weights in question.
  Raster<double> undecided;
  Raster<uint8_t> close_call;  ///< 1 where the median or the strongest is decided by rounding.
};

/// Slow and obvious: every pixel visits every Gaussian, nearest first, with the textbook inverse of
/// the 2x2 covariance, all in double.
///
/// \param slack  relative distance from a threshold within which a pixel counts as undecided
ReferenceImage rasterize_reference(const Gaussians& gaussians,
                                   const Camera& camera,
                                   const Eigen::Vector3d& background,
                                   double slack = 1e-3);

}  // namespace cgs::test
