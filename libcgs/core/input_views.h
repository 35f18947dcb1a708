// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// Chooses the views to reconstruct from: together they show the most of the scene, from directions
/// that differ enough to measure depth and little enough to match. Which view sees what is known
/// from the sparse points or, where these do not say, guessed from how the cameras stand. Of more
/// than a hundred views, a hundred spread over all are considered.
///
/// \param candidates  indices into scene.views, two or more
/// \param count       2 or more
/// \return ascending; fewer than `count` where another view would add nothing, empty where no two
///         candidates see anything together from different places
/// Source: the score of an angle as in Yao et al. 2018, "MVSNet", section 4.1, with a wider best
/// angle: few views have to show a whole scene.
std::vector<int> choose_input_views(const Scene& scene,
                                    const std::vector<int>& candidates,
                                    size_t count);

}  // namespace cgs
