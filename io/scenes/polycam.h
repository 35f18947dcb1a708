// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder, or keyframes/ in it, holds cameras/ or corrected_cameras/ of Polycam.
bool is_polycam(const std::filesystem::path& folder);

/// Reads the raw data of a Polycam capture: per photograph a JSON file with fx fy cx cy, width,
/// height and t_00 … t_23, rows of world_from_cam with ARKit's camera axes (+x right, +y up,
/// looking to -z) in metres, +y up. Where no size is stated (as since 2025), it is that of the
/// photograph; where no principal point is, its middle. The corrected cameras and images are taken
/// where both are there, as they are optimised and without distortion; depth is that of the sensor,
/// in millimetres, without what confidence/ calls low. Other images than those of the corrected
/// cameras keep what distortion they have.
/// \throws BadInput Schema (a field is missing), Value, Empty, as read_json(); LimitError
/// Source: PolyCam/polyform, README.md, "Polycam's data format".
Scene read_polycam(const SceneRoot& root);

}  // namespace cgs
