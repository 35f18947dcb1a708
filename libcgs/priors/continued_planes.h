// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/measured_planes.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Continues ground and walls over what nothing measured, where photographs see it: pavement at
/// one's feet, the wall beside. Only estimated pixels, and those without depth, change; they are
/// estimated.
///
/// A pixel is on the nearest of the planes that may be there: of which something was measured
/// nearer to it in the picture than of anything behind it, and which none of the neighbours() of
/// the view sees past; of a wall, not below what was measured of it. What was measured of other
/// things has the pixels that it is nearer to, where it stands before the plane. Small patches of
/// such depth have no say: repeated windows yield them.
///
/// \param planes  of measured_planes()
/// \param sigma_per_pixel  as in DepthCompletionOptions
/// \param priors  of scene.input, in its order, completed and told apart by mark_estimated()
/// \pre images of scene.input are loaded
void continue_planes(const Scene& scene,
                     const std::vector<MeasuredPlane>& planes,
                     float sigma_per_pixel,
                     std::vector<ViewPriors>& priors,
                     const Progress& progress = {});

}  // namespace cgs
