// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "libcgs/core/raster.h"

namespace cgs {

/// What a look at the pixels of a photograph tells of how it was taken.
struct PhotoQuality {
  double blur = 0;        ///< blur_effect().
  double brightness = 0;  ///< log2 of the mean linear light: 1 more is twice as bright.
  double burnt = 0;       ///< Share of the pixels with a channel at its largest.
  double black = 0;       ///< Share of the pixels with all channels at their smallest.
};

/// Of an sRGB-coded picture in [0, 1].
PhotoQuality photo_quality(const ColorImage& image);

/// How much of the difference between neighbouring pixels is left when the picture is blurred once
/// more: 0 = none, as of noise, 1 = all, as of a picture that was blurred already. Most sharp
/// photographs lie between 0.2 and 0.4. The larger of that along rows and along columns: a camera
/// that shook blurs along one direction.
/// Source: Crete, Dolmiere, Ladret and Nicolas 2007, "The blur effect: perception and estimation
///         with a new no-reference perceptual blur metric".
/// \return 0 for a picture of one colour
double blur_effect(const ColorImage& image);

/// What is odd about photographs of one scene beside each other.
struct PhotoFlaws {
  bool is_blurred = false;       ///< More than those beside it.
  bool is_off_exposure = false;  ///< A stop or more from the median.
  bool is_burnt = false;         ///< Much of it is clipped.
  double stops = 0;              ///< Brighter than the median by so many.
};

/// \return one of each
std::vector<PhotoFlaws> photo_flaws(std::span<const PhotoQuality> photographs);

}  // namespace cgs
