// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"
#include "libcgs/poses/bundle_adjustment.h"
#include "libcgs/poses/photo_pairs.h"

namespace cgs {

/// Refuses photographs that do not determine cameras, with a reason that a user can act on.
/// \throws NumericalError if fewer than two photographs show enough, naming one that does not, or
///         no two share enough, naming the pair that shares most.
void refuse_unconnected(const std::vector<UnposedPhoto>& photos,
                        const std::vector<PhotoPair>& pairs);

/// \throws NumericalError if turning the camera explains every connected pair, at a known focal
///         length or at any.
void refuse_turned_only(const std::vector<UnposedPhoto>& photos,
                        const std::vector<LensPrior>& priors,
                        const std::vector<PhotoPair>& pairs);

/// \throws NumericalError if a focal length of which nothing was known is not determined, most
///         matches disagree with the solution, or a third of the placed photographs look so far
///         aside of all with which they share points that these could not look alike.
/// \param focal_sigmas  per lens, as from adjust_bundle()
void refuse_unsure(const std::vector<UnposedPhoto>& photos,
                   const std::vector<LensPrior>& priors,
                   const std::vector<PhotoPair>& pairs,
                   const Reconstruction& scene,
                   const std::vector<double>& focal_sigmas);

/// The error where the photographs fit more than one focal length; `detail` may be empty.
WithRemedy<NumericalError> undetermined_focal(const std::vector<PhotoPair>& pairs,
                                              const std::string& detail);

/// The reason to give where matches exist that no two cameras explain.
std::string unexplained_matches(const std::vector<UnposedPhoto>& photos,
                                const std::vector<PhotoPair>& pairs);

}  // namespace cgs
