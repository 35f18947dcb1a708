// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/gaussians.h"

namespace cgs {

/// What every writer of splats demands before it writes a byte: arrays of one length, finite
/// positions, rotations and colours, scales > 0, opacities in (0, 1), labels that there are.
/// \throws InvalidInput that names the first array or splat that is not so
void require_writable(const Gaussians& gaussians);

/// \param rule  "NAME must be a rotation; error"
/// \throws InvalidInput if it is none
void require_rotation(const Eigen::Matrix3d& matrix, const char* rule);

}  // namespace cgs
