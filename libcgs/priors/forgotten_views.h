// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Below this share of a view, all that was measured may be false matches.
inline constexpr double kLeastMeasured = 0.01;

/// The share of a view that must be measured for it to tell anything: kLeastMeasured of it, or of a
/// smaller picture of one of its neighbours(), if that much was measured of what both hold. What a
/// photograph through a long lens shows may be less than a hundredth of one that shows the whole.
/// \param priors  of scene.input, in its order
/// \param view    position in scene.input
double least_measured(const Scene& scene, const std::vector<ViewPriors>& priors, size_t view);

/// Leaves nothing of what some input views measured or had filled in: the depth of their pixels is
/// unknown, but those of the background stay that. What they may have confirmed of other views is
/// counted anew: it is confirmed by no more of the neighbours that are left than measured the place
/// alike. None is then observed by views that say nothing of the scene.
/// \param are_forgotten  per input view
void forget_views(const Scene& scene,
                  const std::vector<uint8_t>& are_forgotten,
                  std::vector<ViewPriors>& priors);

}  // namespace cgs
