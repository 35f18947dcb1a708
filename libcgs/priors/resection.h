// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/priors/bundle_adjustment.h"
#include "libcgs/priors/photo_pairs.h"

namespace cgs {

/// Thresholds of a reconstruction, in working pixels and radians.
inline constexpr double kMostError = 4;
inline constexpr double kLeastAngle = 0.01;

/// Places as many photographs as it can, at the focal lengths the lenses have: the pair with many
/// matches and much parallax first, then the photograph that shows the most known points, again
/// and again.
///
/// \param scene  with tracks and lenses; poses and positions are overwritten
/// \return  the photographs that began it, which BundleOptions wants; nothing if no pair could
struct FirstPair {
  int first = 0;
  int second = 0;
};
std::optional<FirstPair> place_photos(Reconstruction& scene,
                                      const std::vector<LensPrior>& priors,
                                      const std::vector<PhotoPair>& pairs);

/// Sum of squared errors of all sightings, none counting more than kMostError² (which those without
/// a point or pose count), per sighting: for comparing solutions of the same tracks.
double capped_error(const Reconstruction& scene);

/// Number of known points that a photograph uses.
int points_in(const Reconstruction& scene, int photo);

}  // namespace cgs
