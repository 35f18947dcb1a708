// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Gives pixels of input views that show what others contradict, such as scratches, stamps and
/// dust on prints, the mean colour of these others.
///
/// A pixel is contradicted where two other views or more, whose depths put them on the same place,
/// show another colour there and one pixel around it. With two photographs nobody can tell which of
/// them is right, and nothing is found. Thin things are found here that find_transients() leaves,
/// which looks at areas.
/// \param priors  of scene.input, in its order
/// \return per input view 1 where it was mended, and beside such pixels
/// \pre images of scene.input are loaded and matched in response and exposure
std::vector<MaskMap> mend_scratches(Scene& scene, const std::vector<ViewPriors>& priors);

}  // namespace cgs
