// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>
#include <pybind11/pybind11.h>

#include "libcgs/core/camera.h"
#include "libcgs/core/frame.h"

namespace cgs {

/// A camera in world coordinates, and one in those of a frame.
/// \throws InvalidInput, the second, for numbers that are not finite or not positive
Camera in_world(Camera camera, const Frame& frame);
Camera in_frame(Camera camera, const Frame& frame);

/// The unit of a frame that came without one.
/// \param metres_per_unit  0 = unknown
/// \throws InvalidInput
void state_unit(Frame& frame, double metres_per_unit);

/// A report as dict, list, float …
pybind11::object python_of(const nlohmann::ordered_json& json);

}  // namespace cgs
