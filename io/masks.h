// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "io/image.h"
#include "io/scene_path.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// The file that says which pixels of a photograph may be used: in a folder "masks" below that of
/// the photograph or any above it, there in the same folders below it (COLMAP:
/// masks/rig1/img.jpg.png for images/rig1/img.jpg). It is named as the photograph (nerfstudio,
/// Brush: img.png for img.jpg, any image format) or with .png after its whole name (COLMAP), which
/// comes first. \throws BadInput Path where it is a link that leaves the scene, as
/// resolve_in_scene(); LimitError
std::optional<std::filesystem::path> mask_file(const SceneRoot& root,
                                               const std::filesystem::path& photograph);

/// The same for a view, whose data set may name the file.
std::optional<std::filesystem::path> mask_file(const SceneRoot& root, const View& view);

/// True if there is a folder of masks, and none in it is for this view.
bool lacks_mask(const SceneRoot& root, const View& view);

/// Leaves usable only the pixels where the mask of a view, if it has one, is at least half as
/// bright as white.
///
/// The mask of a photograph that is turned upright is upright, too: as its own Exif says, or as
/// viewers showed the photograph to whoever painted it. Only where its size tells that it lies as
/// the photograph is stored, it is turned with it.
/// \param size  of the photograph [pixels], turned as the view says
/// \param usable  in and out: 1 = may be used; empty = all may
/// \throws BadInput Mismatch for a mask of another size, and as read_image()
void apply_mask(const SceneRoot& root, const View& view, const ImageSize& size, MaskMap& usable);

}  // namespace cgs
