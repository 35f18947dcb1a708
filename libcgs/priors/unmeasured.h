// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Why the depth of pixels of a view was not measured: shares of its valid pixels. A pixel counts
/// for the first reason that holds. Sky and what moved are no surface, and not among them.
struct UnmeasuredShares {
  double unseen = 0;       ///< No other input view has the place in its picture.
  double hidden = 0;       ///< Those that have it in theirs measured something before it.
  double even = 0;         ///< The photograph shows no texture there.
  double wide = 0;         ///< Others see the place under more than 40 degrees.
  double unconfirmed = 0;  ///< Nothing found there was found from the other side, too: it looks
                           ///< otherwise there, repeats, shines, or the cameras are off.
};

/// Of every input view, in the order of Scene::input.
/// \param priors  completed: the place of a pixel without a depth is not known, and it counts as
///                unconfirmed unless it is even
/// \pre images of scene.input are loaded
std::vector<UnmeasuredShares> unmeasured_shares(const Scene& scene,
                                                const std::vector<ViewPriors>& priors);

}  // namespace cgs
