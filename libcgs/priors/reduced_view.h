// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/scene.h"

namespace cgs {

/// The factor that brings the longest side of pictures nearest to another [pixels]; 1 where they
/// are smaller.
int reduction_to(int wanted, int longest);

/// A view of 1 / `factor` of its size: means of factor x factor pixels, usable where all of them
/// are. What remains at the right and lower border is left out.
/// \pre its image is loaded; factor >= 1
View reduced_view(const View& view, int factor);

/// The input views of a scene alone, reduced, with what else a sweep asks a scene for.
Scene reduced_inputs(const Scene& scene, int factor);

}  // namespace cgs
