// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/render/support.h"

namespace cgs {

/// The smallest depth from `depth` on at which a pixel of a camera stands in no input view's way:
/// outside of their pictures, or a hundredth behind what they saw there. Where a view saw nothing
/// it says nothing.
/// \param camera  [internal units]
/// \param depth   z-depth; > 0
/// \return z-depth [internal units], in steps of a hundredth; NaN if there is none
float hidden_from_all(
    const std::vector<SupportView>& inputs, const Camera& camera, int x, int y, float depth);

/// Leaves out Gaussians of a fill that input views would show if they were drawn together with
/// those of the model: over a sixteenth of a pixel, through Gaussians that are not quite opaque, or
/// over 1/255 of one in a hole of an input view.
void drop_visible(const Model& model, Gaussians& fill);

}  // namespace cgs
