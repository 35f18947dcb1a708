// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/reconstruct/model.h"

namespace cgs {

/// Cameras along a path through a model, as sharp and as wide as its first input view, in internal
/// units. The last one is followed by the first.
///
/// - "between": from input view to input view in their order, and back, slower at both ends
/// - "spiral": an ellipse as wide as the input views are apart, looking at what they look at, as
///   LLFF shows its scenes
/// - "orbit": once around what they look at, about the up axis; no input view saw most of that
///
/// \param frames  2 to 10000
/// \throws InvalidInput for another name or number, or for splats without input views;
///         NumericalError if no depth is known
/// Source: Mildenhall et al. 2019, "Local Light Field Fusion", for the spiral.
std::vector<Camera> camera_path(const Model& model, const std::string& name, int frames);

}  // namespace cgs
