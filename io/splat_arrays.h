// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/gaussians.h"

namespace cgs {

/// What every writer of splats demands before it writes a byte: arrays of one length, finite
/// positions, rotations and colours, scales > 0, opacities in (0, 1).
/// \throws InvalidInput that names the first array or splat that is not so
void require_writable(const Gaussians& gaussians);

}  // namespace cgs
