// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/poses/photo_features.h"

namespace cgs {

/// A photograph whose camera is wanted.
struct UnposedPhoto {
  std::string name;  ///< For messages.
  int width = 0;     ///< [pixels]
  int height = 0;    ///< [pixels]
  PhotoFeatures features;
  int lens = 0;            ///< Photographs of one lens share what a Lens says.
  int turns = 0;           ///< Quarter turns, clockwise, from how the sensor lay to this picture.
  double focal = 0;        ///< What is known of it beforehand [pixels]; 0 = nothing.
  double focal_sigma = 0;  ///< Relative standard deviation of `focal`; 0 = exact.
};

}  // namespace cgs
