// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/scenes/colmap_model.h"
#include "io/scenes/scene_options.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// Recognises the layout of a folder (see layout_of()) and reads cameras and image sizes, but no
/// pixels.
///
/// The result is in world coordinates with the identity frame, views sorted by name. Cameras have
/// the size of the image file divided by `downscale`, rounded down; where the layout states
/// another size of the same shape, intrinsics are scaled to the file. Input views and those held
/// out as choose_views() says.
///
/// \throws InvalidInput (options; a view that does not exist, is named twice or has no file),
///         BadInput Open (no such folder), Schema (layout not recognised), Empty (fewer than two
///         views), Missing (no image at all), Mismatch (image of another shape than its camera),
///         Value (input cameras in one place; as check_significance()), and as the readers of the
///         layouts.
Scene read_scene(const std::filesystem::path& folder, const SceneOptions& options = {});

/// The scene of photographs whose cameras were solved for, as read_scene() gives it for a folder
/// that states them; `kind` is SceneKind::Photographs.
///
/// \param folder  holds the photographs
/// \throws Error as read_scene()
Scene scene_of_photographs(const std::filesystem::path& folder,
                           const ColmapModel& model,
                           const SceneOptions& options = {});

/// Decodes the images of some views, takes lens distortion out and averages them down to the size
/// of their camera, in place. View::distortion stays, as it describes the file; View::valid marks
/// the usable pixels where not all are. Odd pictures (constant, fully masked, identical) become
/// warnings.
///
/// \param views  indices into scene.views that have an image file
/// \throws BadInput as read_image(), Missing; Mismatch if a file has changed its shape; LimitError.
void load_images(Scene& scene, const std::vector<int>& views, const Progress& progress = {});

/// A copy of one view, loaded as by load_images(). Any number of threads may ask at once.
///
/// \param with_image  false leaves `image` empty where it can be, which is much quicker
/// \param warnings    gets what is odd
/// \throws Error as load_images()
View loaded_view(const Scene& scene, int view, bool with_image, std::vector<std::string>& warnings);

}  // namespace cgs
