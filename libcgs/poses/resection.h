// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "libcgs/poses/bundle_adjustment.h"
#include "libcgs/poses/photo_pairs.h"

namespace cgs {

/// Thresholds of a reconstruction, in working pixels.
inline constexpr double kMostError = 4;
inline constexpr double kLeastParallax = 1.5;  ///< Median, of pairs to begin with.

/// Least angle [rad] between two rays that tell where a point is: 0.01, as 12.5 working pixels are
/// through the lens of a phone; as many pixels where all lenses are known beforehand to be longer.
/// (Any focal length may be tried where it is not known: the smaller the angle, the more points a
/// wrong one explains.)
double least_angle(const std::vector<LensPrior>& priors);

/// The photographs a reconstruction began with, as BundleOptions wants them.
struct FirstPair {
  int first = 0;
  int second = 0;
};

/// A reconstruction on the way, and how well it explains its tracks.
struct PlacedPhotos {
  Reconstruction scene;
  std::optional<FirstPair> begun;                          ///< None where nothing could be placed.
  double error = std::numeric_limits<double>::infinity();  ///< capped_error() [working pixels²].
};

/// Places as many photographs as it can, at the focal lengths the lenses have: a pair with many
/// matches and much parallax first, then the photograph that shows the most known points, again
/// and again. Of the most promising pairs to begin with, the one that explains most is kept.
///
/// \param start     with tracks and lenses; poses and positions count for nothing
/// \param most      photographs to place, at most
/// \param progress  told again and again, never how much is done; from any thread, several at once
/// \return no pose if no pair could be placed
PlacedPhotos place_photos(const Reconstruction& start,
                          const std::vector<LensPrior>& priors,
                          const std::vector<PhotoPair>& pairs,
                          size_t most,
                          const Progress& progress = {});

/// Goes on from there: triangulates what the placed photographs show and places further ones, until
/// there are `most`.
void place_more(Reconstruction& scene,
                const std::vector<LensPrior>& priors,
                const FirstPair& begun,
                size_t most,
                const Progress& progress = {});

/// Whether the first has the smaller error.
bool explains_more(const PlacedPhotos& a, const PlacedPhotos& b);

/// Mean squared error of all observations, each at most kMostError² (those without a point or pose
/// count as much): for comparing solutions of the same tracks.
double capped_error(const Reconstruction& scene);

/// Number of known points that a photograph uses.
int points_in(const Reconstruction& scene, int photo);

}  // namespace cgs
