// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds frames of a depth camera in one of the layouts of read_rgbd_frames().
bool is_rgbd_frames(const std::filesystem::path& folder);

/// Reads photographs of a depth camera with their poses (world_from_cam, +x right, +y down, +z
/// forward) in metres and their depth in millimetres:
///
/// - 7-Scenes and 3DMatch: frame-N.color.png (or .jpg), frame-N.depth.png and frame-N.pose.txt
///   (four rows of four numbers), beside camera-intrinsics.txt (three rows of three) or in seq-*
///   below it. A pose that is not finite tells that tracking was lost: the frame is left out, with
///   a warning.
/// - Open3D: color/ (or image/, rgb/) and depth/ with as many files, trajectory.log (or in scene/)
///   with a pose for each in their order, and camera_intrinsic.json or intrinsic.json.
///
/// Both count pixels from the middle of the first, which is (0.5, 0.5) here.
/// \throws BadInput Schema (no intrinsics, no depth), Mismatch (poses and photographs differ in
///         number), Value, Syntax, Truncated, Empty; LimitError
/// Source: Shotton et al. 2013, 7-Scenes, readme; Zeng et al. 2017, 3DMatch, "RGB-D Reconstruction
///         Datasets"; Open3D 0.19, io/file_format/FileLOG.cpp, camera/PinholeCameraIntrinsic.cpp.
Scene read_rgbd_frames(const SceneRoot& root);

}  // namespace cgs
