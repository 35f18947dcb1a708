// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"

namespace cgs {

/// Paints in the gaps of a picture with pieces of what lies around them, so that texture goes on
/// there. Every 7 x 7 window of a gap becomes like a window of the known picture; a piece that
/// stands before what a gap hides (nearer than kFarSide of it) is never taken, and what stands
/// beside a gap in front of it is not looked at.
///
/// \param picture  what is known; in gaps, colours to begin with, as of filled_picture()
/// \param open     1 = in a gap
/// \param depth    outside of gaps of what is shown, NaN where no piece may come from (unknown, or
///                 sky), 0 where nothing is shown that a gap could go on with; in gaps of what they
///                 hide [any unit]
/// \return the picture with painted gaps; where no piece is far enough, as it began. The same bits
///         for any number of threads: random numbers are those of their index
/// Source: Wexler et al. 2007, "Space-Time Completion of Video", eq. 4 and 5, coarse to fine;
///         windows by Barnes et al. 2009, "PatchMatch", pixels visited as on a chessboard.
ColorImage exemplar_fill(const ColorImage& picture, const MaskMap& open, const DepthMap& depth);

}  // namespace cgs
