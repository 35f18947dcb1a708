// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/frame.h"

namespace cgs {

/// [x, y, z]
nlohmann::ordered_json vector_to_json(const Eigen::Vector3d& v);

/// A frame as JSON, numbers in the shortest form that reads back to the same bits.
nlohmann::ordered_json frame_to_json(const Frame& frame);
Frame frame_from_json(const nlohmann::ordered_json& json);

}  // namespace cgs
