// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// What two views tell of a point between whose directions this angle lies [rad], from 0 (nothing)
/// to 1 (at 10 degrees, the most).
/// Source: Yao et al. 2018, "MVSNet", section 4.1, with a wider best angle: few views have to show a
/// whole scene.
double worth_of_angle(double radians);

/// Chooses the views to reconstruct from: together they show the most of the scene, from directions
/// that differ enough to measure depth and little enough to match. Which view sees what is known
/// from the sparse points or, where these do not say, guessed from how the cameras stand. Of more
/// than a hundred views, a hundred spread over all are considered.
///
/// \param candidates  indices into scene.views, two or more
/// \param count       2 or more
/// \return ascending; fewer than `count` where another view would add nothing, empty where no two
///         candidates see anything together from different places
std::vector<int> choose_input_views(const Scene& scene,
                                    const std::vector<int>& candidates,
                                    size_t count);

}  // namespace cgs
