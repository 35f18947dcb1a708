// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/given_depth.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Fills the pixels of a view that have no measured depth, as complete_depth() does.
using Completion = std::function<void(ViewPriors& priors)>;

/// A fitted depth, bent to go through the measured pixels around, and how far to trust it.
struct DepthGuess {
  DepthMap depth;  ///< z-depth [internal units]; NaN where measured, unusable, or where completion
                   ///< from the neighbours is expected to be nearer to the truth.
  DepthMap sigma;  ///< Standard deviation [internal units]; NaN as depth.
};

/// What given depth says about the pixels that no other view confirms.
///
/// The shape is that of the given depth. Its deviation from the measured pixels, found along rays
/// in 16 directions, is carried over to the pixels between, less the farther away and the more the
/// given depth changes on the way. How well that works is tried out: patches of measured pixels are
/// hidden, guessed and completed, and compared to what was hidden, by distance to the next pixel
/// that was not. Where completion was better at a distance, there is no guess at that distance;
/// elsewhere sigma is what was found.
/// \param priors    of plane_sweep() after alignment, not completed
/// \param complete  how pixels would be filled without given depth
DepthGuess guess_depth(const FittedDepth& fitted,
                       const View& view,
                       const ViewPriors& priors,
                       const Completion& complete);

/// Takes out guesses that contradict another view: those that would stand before what it measured,
/// and both where two guesses contradict each other.
///
/// \param cameras, priors  of the input views, in one order; priors not completed
void remove_contradictions(const std::vector<Camera>& cameras,
                           const std::vector<ViewPriors>& priors,
                           std::vector<DepthGuess>& guesses);

/// Puts guesses in place of completed depth; they get origin Guessed. \return number of pixels
size_t enter_guess(const DepthGuess& guess, ViewPriors& priors);

}  // namespace cgs
