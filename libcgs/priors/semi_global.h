// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/progress.h"
#include "libcgs/core/raster.h"
#include "libcgs/priors/matching_cost.h"

namespace cgs {

/// Penalties of semi-global matching, in units of CostVolume::cost.
struct SmoothnessPenalties {
  int small_step = 8;    ///< P1, for a change by one plane.
  int large_step = 48;   ///< P2, for a larger change on an even image.
  float edge_level = 8;  ///< P2 halves where the image changes by this much [gray levels].
};

/// Plane of least cost per pixel after regularisation along eight paths, refined between planes by
/// a parabola.
/// Source: Hirschmüller 2008, "Stereo processing by semiglobal matching".
///
/// \param guide gray levels of the view the volume belongs to
Raster<float> semi_global_planes(const CostVolume& volume,
                                 const Raster<float>& guide,
                                 const SmoothnessPenalties& penalties,
                                 const Progress& progress = {});

}  // namespace cgs
