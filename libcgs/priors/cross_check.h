// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/priors/slanted_refinement.h"

namespace cgs {

/// What a view holds after refinement, and the planes it is expressed in.
struct SweptView {
  Camera camera;
  SweepGeometry geometry;
  Raster<RefinedPixel> pixels;
};

/// How far the other views agree with a pixel.
struct Agreement {
  uint8_t views = 0;         ///< Other views that confirm it.
  uint8_t seen_through = 0;  ///< Those that see something farther away there.
  float difference = 0;      ///< Root mean square difference of t to those views [planes].
  float parallax = 0;  ///< Largest way that the pixel makes in one of them [pixels per plane].
};

/// What counts as agreement.
struct AgreementLimits {
  double max_disagreement;  ///< [pixels, and planes]; > 0.
  double least_disparity;   ///< Way of the pixel in the other view, from infinity to its depth
                            ///< [pixels]; > 0.
};

/// Checks a view against the sources of its geometry: another view confirms a pixel if its own
/// depth, at the place the pixel projects to, leads back to within `max_disagreement`. A view from
/// so nearly the same place that the pixel moves by less than `least_disparity` confirms nothing.
Raster<Agreement> cross_check(const std::vector<SweptView>& views,
                              size_t view,
                              const AgreementLimits& limits);

/// The surface that other views confirm at the pixels of a view, nearest in front; t is NaN where
/// they show none. `agreements` are those of all views.
Raster<SlantedPlane> planes_of_others(const std::vector<SweptView>& views,
                                      size_t view,
                                      const std::vector<Raster<Agreement>>& agreements);

}  // namespace cgs
