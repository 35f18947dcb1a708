// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// Writes the cameras of a scene in the layout of 3D Gaussian Splatting: an array of {id, img_name,
/// width, height, position, rotation, fx, fy}, position and rotation being world_from_cam in file
/// coordinates (Frame::file_from_internal), rotation as rows.
///
/// Keys that other viewers ignore make the scene complete: per entry cx, cy, role ("input",
/// "held_out" or ""), near, far, distortion, fisheye, image_path (absolute) and internal_position,
/// in the first entry also frame and water [1 / internal unit].
/// \throws InvalidInput if a camera is not finite; IoError
/// Source: graphdeco-inria/gaussian-splatting, the cameras.json of a trained model.
void write_cameras_json(const std::filesystem::path& path, const Scene& scene);

/// Restores the scene of write_cameras_json() in internal units, without pixels and sparse points;
/// internal cameras come back bit for bit. A position that was edited in the file counts.
///
/// In files of other programs the principal point is the centre, the frame the identity, the kind
/// SceneKind::ForeignCameras, and neither input nor held-out views are known; of "cam1/0.png" the
/// view is cam1_0.png. Images that no longer exist are listed as missing. \param names  gets the
/// name of each view as the file has it \throws BadInput Syntax, Schema, Value, naming the JSON
/// pointer; Empty (no camera); LimitError.
Scene read_cameras_json(const std::filesystem::path& path,
                        std::vector<std::string>* names = nullptr);

}  // namespace cgs
