// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "io/scene_path.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// The file that says which pixels of a photograph may be used: in a folder "masks" beside or below
/// that of the photograph, named as the photograph (nerfstudio, Brush: img.png for img.jpg, any
/// image format) or with .png after its whole name (COLMAP: img.jpg.png), which comes first.
/// \throws BadInput Path where it is a link that leaves the scene, as resolve_in_scene();
/// LimitError
std::optional<std::filesystem::path> mask_file(const SceneRoot& root,
                                               const std::filesystem::path& photograph);

/// True if there is a folder of masks, and none in it is for this photograph.
bool lacks_mask(const SceneRoot& root, const std::filesystem::path& photograph);

/// Leaves usable only the pixels where the mask of a photograph, if it has one, is at least half as
/// bright as white.
///
/// \param width, height  of the photograph as stored
/// \param usable  in and out: 1 = may be used; empty = all may
/// \throws BadInput Mismatch for a mask of another size, and as read_image()
void apply_mask(const SceneRoot& root,
                const std::filesystem::path& photograph,
                int width,
                int height,
                MaskMap& usable);

}  // namespace cgs
