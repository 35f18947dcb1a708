// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/poses/bundle_adjustment.h"
#include "libcgs/poses/photo_pairs.h"
#include "libcgs/poses/reconstruction.h"
#include "libcgs/poses/resection.h"
#include "libcgs/poses/unposed_photo.h"

namespace cgs {

/// Up to `most` of the tracks, those that most photographs show first, else evenly.
std::vector<Track> sample_tracks(const std::vector<Track>& tracks, size_t most);

/// Photographs placed at the focal lengths from which a part of the points is explained best.
/// Several are tried, the same for all lenses of which nothing is known. Where more than one focal
/// length is vague, what was placed at wrong ones stays in the way of the right ones: it is begun
/// again at those that were found, as long as that explains more.
/// \return  with a part of the tracks
/// \throws NumericalError (Remedy::FocalLength) if quite another one does nearly as well
PlacedPhotos place_at_best_focal(const std::vector<UnposedPhoto>& photos,
                                 const std::vector<LensPrior>& priors,
                                 const std::vector<PhotoPair>& pairs,
                                 const std::vector<Track>& tracks,
                                 const Progress& progress);

}  // namespace cgs
