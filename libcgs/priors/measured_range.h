// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/scene.h"
#include "libcgs/priors/plane_sweep.h"

namespace cgs {

/// Gives every input view that states no depth range (near = far = 0) the one that a sweep at a
/// quarter of the image size measures, with a margin; never wider than depth_range().
///
/// A range guessed from the cameras alone is so wide that repetitive and textureless surfaces find
/// a chance match far from the scene; the full sweep also spends its planes where nothing is.
/// Views with little to measure keep the guess.
/// Preconditions and errors as plane_sweep().
void narrow_depth_ranges(Scene& scene,
                         const PlaneSweepOptions& options,
                         const Progress& progress = {});

}  // namespace cgs
