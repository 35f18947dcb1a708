// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/exposure.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Difference in a channel of two photographs, 0.25 = one is brighter by a quarter, below which
/// they count as exposed alike: automatic exposures go in larger steps, and what shines or is
/// matched wrongly makes smaller ones.
inline constexpr float kLeastDifference = 0.03f;

/// The gains of the input views from pixels whose measured depth another view confirms. In each
/// channel of each group of views that share surface, the gain in the middle is 1: one photograph
/// that stands out is brought to the others, and views that are held out are likely to agree.
///
/// \param priors  of the input views, in their order
/// \return in the order of Scene::input; all exactly 1 unless two differ by kLeastDifference
/// \throws InvalidInput if the image of an input view is not loaded
ExposureGains exposure_gains(const Scene& scene, const std::vector<ViewPriors>& priors);

}  // namespace cgs
