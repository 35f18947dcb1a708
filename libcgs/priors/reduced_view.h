// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/scene.h"

namespace cgs {

/// A view of 1 / `factor` of its size: means of factor x factor pixels, usable where all of them
/// are. What remains at the right and lower border is left out.
/// \pre its image is loaded; factor >= 1
View reduced_view(const View& view, int factor);

/// The input views of a scene alone, reduced, with what else a sweep asks a scene for.
Scene reduced_inputs(const Scene& scene, int factor);

}  // namespace cgs
