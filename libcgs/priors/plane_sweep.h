// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/semi_global.h"
#include "libcgs/priors/sweep_geometry.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Depth from photographs with known cameras.
struct PlaneSweepOptions {
  SweepSampling sampling;
  SmoothnessPenalties smoothness;
  int refinement_rounds = 4;     ///< >= 0; each costs about as much as the sweep.
  double max_disagreement = 1;   ///< Another view confirms a depth if the pixel comes back this
                                 ///< close [pixels]; > 0.
  double least_disparity = 1.5;  ///< … and if a point at infinity would lie this far off in it
                                 ///< [pixels]; > 0. Less tells depth from nothing.
  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Depth of every input view: plane sweep over inverse depth, semi-global regularisation, slanted
/// refinement and a check against the other views. No network, no training.
///
/// \pre images of scene.input are loaded; the scene is in its canonical frame
/// \return in the order of scene.input; origin Measured where another view confirms the depth,
///         else Unknown with NaN depth. `layer` is left 0.
/// \throws InvalidInput for fewer than two input views or images not of their camera's size,
///         BadInput(Value) if the cameras share one centre
std::vector<ViewPriors> plane_sweep(const Scene& scene,
                                    const PlaneSweepOptions& options,
                                    const Progress& progress = {});

}  // namespace cgs
