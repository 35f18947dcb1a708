// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds transforms.json or transforms_train.json.
bool is_transforms_json(const std::filesystem::path& folder);

/// Reads cameras in the layout of instant-ngp and nerfstudio: OpenGL camera axes (+x right, +y up,
/// +z backward), world_from_cam as transform_matrix, intrinsics per frame or for all.
///
/// Focal lengths come from fl_x, fl_y or camera_angle_x, camera_angle_y; cx, cy default to the
/// centre; w, h to the size of the image file, which they must match otherwise. Lens distortion
/// (k1 k2 k3 p1 p2; with OPENCV_FISHEYE or is_fisheye k1 k2 k3 k4 p1 p2) is left to load_images().
/// For a file_path without extension, .png, .jpg and .jpeg are tried. Frames whose file is missing
/// keep their camera.
/// \throws BadInput Syntax, Schema, Value, Unsupported (other models and terms), Path, Mismatch,
///         Empty (no frames); each names the JSON pointer. LimitError.
/// Source: nerfstudio documentation, "Data conventions"; instant-ngp, its NeRF dataset notes.
Scene read_transforms_json(const SceneRoot& root);

}  // namespace cgs
