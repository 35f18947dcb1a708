// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds a cameras.json with an array of cameras, as 3D Gaussian Splatting
/// writes it.
bool is_cameras_json(const std::filesystem::path& folder);

/// Reads cameras.json of 3D Gaussian Splatting as a scene in world coordinates; photographs lie in
/// images/ or beside it, named as the file says, with or without extension.
/// \throws BadInput, LimitError as read_cameras_json()
Scene read_cameras_json_scene(const SceneRoot& root);

}  // namespace cgs
