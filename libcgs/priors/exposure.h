// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/exposure.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Gains of the input views of a scene below which photographs count as exposed alike: an automatic
/// exposure goes in larger steps, and what is matched wrongly or shines makes smaller ones.
inline constexpr float kLeastGain = 0.03f;  ///< |gain - 1|

/// The gains of the input views from pixels whose measured depth another view confirms. What they
/// agree on is the exposure in the middle, so that one photograph that stands out is brought to
/// that of the others, and views that are held out are likely to have it, too.
///
/// \param priors  of the input views, in their order
/// \return in the order of Scene::input; all exactly 1 unless one differs by kLeastGain or more
/// \throws InvalidInput if the image of an input view is not loaded
ExposureGains exposure_gains(const Scene& scene, const std::vector<ViewPriors>& priors);

}  // namespace cgs
