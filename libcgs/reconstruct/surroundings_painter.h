// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"
#include "libcgs/reconstruct/painted_fill.h"

namespace cgs {

/// What a program paints into holes where nobody else does.
struct PaintedSurroundings {
  ColorImage picture;
  MaskMap left_open;  ///< 1 = a hole that is not painted.
};

/// Holes of a view that painted_surroundings() leaves open (1), as other things are known of them,
/// or too little: what an input view looks at without knowing a surface there, as its photograph
/// shows something else, or sky, or a mask leaves it out; holes in the sky, by the shown pixel next
/// to them, where what is painted would stand in the air; all of a gap of which these are half; and
/// what lies farther than a twelfth of the picture's width from anything that an input view shows.
MaskMap holes_left_open(const ViewToPaint& view);

/// Paints the other holes of a view with pieces of what is shown around them: exemplar_fill() by
/// depth.
PaintedSurroundings painted_surroundings(const ViewToPaint& view);

}  // namespace cgs
