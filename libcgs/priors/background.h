// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Gives the origin Background to what lies around an object that is all there is to reconstruct:
/// pixels through which nothing of it is seen, so that what lies there in no view is empty space
/// and no hidden matter.
///
/// It is what masks leave out of the photographs, or an even backdrop that runs along most of the
/// border of each. Both may mean something else, a passer-by or a bare wall; so nothing is marked
/// unless three of four views show some and agree: what others measured, in front or behind, hardly
/// ever lies where a view would see background. Pixels near the rim of the object, and near the few
/// such places, are not marked. What one view measured where most others see background is a
/// mistake, and loses its depth.
/// \param priors  measured, not yet completed; of the input views in their order
/// \pre images of scene.input are loaded, and View::valid is what masks say
/// Source: Laurentini 1994, "The visual hull concept for silhouette-based image understanding".
void mark_background(const Scene& scene, std::vector<ViewPriors>& priors);

}  // namespace cgs
