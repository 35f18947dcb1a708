// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "libcgs/core/raster.h"

namespace cgs {

/// What a pixel is to a membrane.
enum class MembranePixel : uint8_t {
  Outside = 0,  ///< No part of it: it ends here, with no force across the edge.
  Fixed = 1,    ///< It is held at its value.
  Open = 2,     ///< Its value is found.
};

/// Lets a membrane come to rest between what holds it: each open value becomes the mean of its
/// neighbours, drawn to 0. Linear values between lines that hold it stay linear.
///
/// \param values   those of open pixels are where it starts, and what is found; finite
/// \param pixels   of the same size
/// \param reach    [pixels] over which it falls to 0 by a factor of e; 0 = it is not drawn to 0
/// \param sweeps   over all pixels, at most: fewer where none moves any more, by a millionth of the
///                 largest value; the way to go in a gap is about half its width squared, less what
///                 the start is right about
/// Source: Pérez et al. 2003, "Poisson Image Editing", section 2, of a field without guidance;
///         successive over-relaxation, red and black pixels in turn (Young 1954).
void relax_membrane(Raster<float>& values,
                    const Raster<MembranePixel>& pixels,
                    float reach,
                    int sweeps);

}  // namespace cgs
