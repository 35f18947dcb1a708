// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
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

/// Cameras in the frame of a model, as write_cameras_json() takes them.
/// \param name_of  of each, by its place
Scene scene_of_cameras(const Model& model,
                       const std::vector<Camera>& cameras,
                       const std::function<std::string(size_t)>& name_of);

}  // namespace cgs
