// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/poses/reconstruction.h"
#include "libcgs/poses/unposed_photo.h"

namespace cgs {

/// Moves the observations of known points to where the pictures around them agree best, and states
/// how well each is known then. Features are found in each photograph alone, to a third of a pixel;
/// together photographs tell their places several times better.
///
/// Of each point, the observation that looks at it most like the others stays; a small patch around
/// it is fitted to the others' pictures, warped by an affine map, with another brightness and
/// contrast. An observation that no patch fits, that would be moved further than features err, or
/// that shows too little to tell, stays as it is. Photographs without a picture are left as they
/// are.
///
/// The same for any number of threads.
/// Source: Gruen 1985, "Adaptive Least Squares Correlation".
void refine_observations(const std::vector<UnposedPhoto>& photos,
                         Reconstruction& scene,
                         const Progress& progress = {});

}  // namespace cgs
