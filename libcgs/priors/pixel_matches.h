// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// A pixel of one view, and where another view shows the same point of the surface.
struct PixelMatch {
  int32_t pixel = 0;  ///< Index of the pixel in the first view, row-major.
  float u = 0;        ///< Place in the second view [pixels, centres at +0.5].
  float v = 0;
};

/// Pixels of the first view whose measured depth the second one confirms, within three sigma and
/// 0.5 % of the depth, with the place where it does; in the order of the pixels.
std::vector<PixelMatch> pixel_matches(const Camera& first,
                                      const ViewPriors& own,
                                      const Camera& second,
                                      const ViewPriors& other);

}  // namespace cgs
