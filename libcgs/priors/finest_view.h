// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Marks in ViewPriors::shown_finer what needs no Gaussian of its own: pixels whose place another
/// input view shows as surely, on a smaller piece of surface per pixel. Gaussians then follow the
/// surface, however many photographs show it. Along the borders of what stays, a few pixels more
/// stay, so that pieces from different views overlap.
///
/// Up to kShownByAll input views nothing is marked: they hardly show the same thing twice, and
/// their Gaussians together average what each saw.
///
/// \param priors  of scene.input, in its order, completed
void mark_shown_finer(const Scene& scene, std::vector<ViewPriors>& priors);

/// Most input views of which each draws all that it shows.
inline constexpr size_t kShownByAll = 4;

}  // namespace cgs
