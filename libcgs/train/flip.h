// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"

namespace cgs {

/// FLIP: how much two pictures differ to someone who flips between them on a screen, the mean of
/// its map over pixels, in [0, 1]; 0 = the same. Colours are compared as the eye resolves them, and
/// edges and points add to it where one picture alone has them.
///
/// A degree of view holds 67.02 pixels: a monitor 0.7 m wide and 3840 pixels across, seen from
/// 0.7 m, as the authors report it. Values outside [0, 1] are clamped; beyond borders the nearest
/// pixel goes on. It is symmetric in its arguments.
///
/// \param use  if given, only its non-zero pixels count; the map is that of the whole pictures
/// \throws InvalidInput if sizes differ or no pixel counts.
/// Source: Andersson et al. 2020, "FLIP: a difference evaluator for alternating images", sections
///         4.1 (colour: Eqs. 1 to 3), 4.2 (features: Eq. 4 and 5) and 4.3 (Eq. 6).
double flip(const ColorImage& a, const ColorImage& b, const MaskMap* use = nullptr);

}  // namespace cgs
