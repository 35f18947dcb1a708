// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include "libcgs/core/scene.h"

namespace cgs {

/// What a look at the pixels of each view that is used tells: blur, exposure, and what is clipped.
/// What is odd about it becomes a warning of the scene.
/// \param small  becomes the scene with the input views loaded, of some 256 pixels
/// \throws Error as loaded_view()
nlohmann::ordered_json photographs_to_json(Scene& scene, Scene& small);

/// What a sweep tells of each input view: the share that is measured, and that which moved; null of
/// fewer than two.
/// \param small  of photographs_to_json()
/// \throws Error as estimate_priors(), but 0 where nothing is measured
nlohmann::ordered_json coarse_depth_to_json(const Scene& small);

/// A line for each photograph.
/// \param coarse_depth  may be null
void print_photographs(const nlohmann::ordered_json& photographs,
                       const nlohmann::ordered_json& coarse_depth);

}  // namespace cgs
