// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace cgs {

/// How many of the lowest bits of a colour need not be kept, where linear light in [0, 1] is stored
/// as whole numbers of `bits` bits, as in glTF. The eye, and the sRGB code with it, tells bright
/// values apart less finely than dark ones: zeros there pack to nothing, and move the code by at
/// most half of its 255 levels' distance. Never more for darker values.
/// \param linear  in [0, 1]
int spare_color_bits(float linear, int bits);

}  // namespace cgs
