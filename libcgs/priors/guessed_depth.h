// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/priors/given_depth.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// A fitted depth, bent to go through the measured pixels around, and how far to trust it.
struct DepthGuess {
  DepthMap depth;  ///< z-depth [internal units]; NaN where measured or unusable.
  DepthMap sigma;  ///< Standard deviation [internal units]; NaN as depth.
};

/// What given depth says about the pixels that no other view confirms.
///
/// The shape is that of the given depth. Its deviation from the measured pixels, found along rays
/// in 16 directions, is carried over to the pixels between, less the farther away and the more the
/// given depth changes on the way; deviations beyond what the fit leaves are errors of one of the
/// two, and stay where they are. Sigma is found by trying: patches of measured pixels are hidden
/// and guessed, and the guesses compared to what was hidden, by distance to the next pixel that was
/// not, and by how steep the given depth is: networks put depth edges beside their place.
/// \param priors  of plane_sweep() after alignment, not completed
DepthGuess guess_depth(const FittedDepth& fitted, const View& view, const ViewPriors& priors);

/// Takes out guesses that contradict one of the neighbours() of their view: those that would stand
/// before what it measured, and both where two guesses contradict each other. Measured pixels that
/// the given depth of their own view contradicts have no say: beside surfaces without texture they
/// are often wrong.
///
/// \param fitted, priors  of the input views, in their order; priors not completed
void remove_contradictions(const Scene& scene,
                           const std::vector<FittedDepth>& fitted,
                           const std::vector<ViewPriors>& priors,
                           std::vector<DepthGuess>& guesses);

/// Puts guesses in place of completed depth whose relative sigma is larger; they get origin
/// Guessed.
/// \return number of pixels
size_t enter_guess(const DepthGuess& guess, ViewPriors& priors);

}  // namespace cgs
