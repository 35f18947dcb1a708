// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds poses_bounds.npy.
bool is_llff(const std::filesystem::path& folder);

/// Reads a scene in LLFF layout: poses_bounds.npy of N rows (3 x 5 row-major [R | t | (H, W, f)],
/// near, far; camera axes are the columns down, right, backward) and N images in images_8,
/// images_4, images_2 or images, whichever exists first, in the order of their names.
///
/// Where only some of the images are present, a text file INDEX.txt of lines "<row> <file name>"
/// says which row is whose. World coordinates are those of the file; cameras have the size the file
/// states; near and far are the row's bounds. Points of sparse/0/points3D.bin or
/// sparse/points3D.bin are added where they provably share the coordinates.
/// \throws BadInput Schema (shape), Mismatch (N is not the number of images), Value (naming the
///         row), and as read_npy() and resolve_in_scene().
/// Source: Mildenhall et al. 2019, "Local Light Field Fusion", its data format.
Scene read_llff(const SceneRoot& root);

}  // namespace cgs
