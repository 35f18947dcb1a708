// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "io/scenes/fisheye_map.h"
#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Takes lens distortion out of a photograph, in place: what a pinhole camera of the same K and
/// size would have recorded. Bicubic, clamped to [0, 1]; 0 where there is nothing to see.
///
/// \param valid       in: usable pixels, empty = all; out: the same, less those the photograph does
///                    not reach; empty again if every pixel is usable
/// \param camera      intrinsics at the size of the image
/// \param distortion  k1 k2 p1 p2 k3 (Brown-Conrady, as OpenCV's calibration model)
void undistort(ColorImage& image,
               MaskMap& valid,
               const Camera& camera,
               const std::array<double, 5>& distortion);

/// The same for a fisheye photograph: the image becomes fisheye.picture() in size and content.
void undistort(ColorImage& image, MaskMap& valid, const FisheyeMap& fisheye);

/// Where a point of a photograph lies in the picture undistort() makes of it [pixels]. What that
/// picture does not hold, as the lens folds there, comes back anywhere: see is_undone().
Eigen::Vector2d undistorted(const Eigen::Vector2d& point,
                            const Camera& camera,
                            const std::array<double, 5>& distortion);

/// Where a point of that picture lies in the photograph [pixels]; NaN where the lens folds.
Eigen::Vector2d distorted(const Eigen::Vector2d& point,
                          const Camera& camera,
                          const std::array<double, 5>& distortion);

/// Whether undistorted() found the place that the lens puts at the point, to 0.01 pixels, and
/// within what undistort() shows.
bool is_undone(const Eigen::Vector2d& point,
               const Eigen::Vector2d& undistorted,
               const Camera& camera,
               const std::array<double, 5>& distortion);

/// Averages the usable pixels under each pixel of a smaller image, in place. A pixel is usable if
/// at least half of its area is; `valid` is emptied if every pixel is.
/// \pre 0 < width <= image.width, 0 < height <= image.height
void area_downscale(ColorImage& image, MaskMap& valid, int width, int height);

}  // namespace cgs
