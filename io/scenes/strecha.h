// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder or a folder directly in it holds files IMAGE.camera, IMAGE being the name of
/// an image file.
bool is_strecha(const std::filesystem::path& folder);

/// Reads cameras of the Strecha benchmark: per image a text file with K, a row of zeros for
/// distortion, the rotation world_from_cam, the camera centre, and the image size. Images lie
/// beside the .camera files or in images/.
/// \throws BadInput Syntax, Value, Unsupported (skew, distortion), Path.
/// Source: Strecha et al. 2008, "On Benchmarking Camera Calibration and Multi-View Stereo", data
///         format; P = K [R^T | -R^T t].
Scene read_strecha(const SceneRoot& root);

}  // namespace cgs
