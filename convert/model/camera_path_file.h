// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/reconstruct/model.h"

namespace cgs {

/// Names and cameras of a file in the layout of cameras.json, in the coordinates of the files of a
/// model.
/// \throws BadInput as read_cameras_json()
std::vector<View> camera_views_from(const std::filesystem::path& file, const Model& model);

/// Its cameras alone.
/// \throws BadInput as read_cameras_json()
std::vector<Camera> camera_path_from(const std::filesystem::path& file, const Model& model);

}  // namespace cgs
