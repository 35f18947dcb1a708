// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "io/scenes/colmap_model.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds a COLMAP model where read_colmap() looks for one.
bool is_colmap(const std::filesystem::path& folder);

/// Reads a COLMAP reconstruction: the model in sparse/0, sparse/1 …, sparse or the folder itself,
/// else in sparse_3/0 and such, colmap/sparse/ or distorted/sparse/; of several in one place that
/// with most images, which is told. Binary files are preferred over text. The photographs lie in
/// images/, input/ or beside the model, wherever most of them are, or smaller ones in images_2/,
/// images_4/ or images_8/ where none are; their names may differ from those of the model as
/// PhotographIndex::take_path() says. Cameras that no image names are not judged.
///
/// Cameras have the size the model states, and lens distortion is left to load_images(). Points
/// keep the views that observed them; what is wrong with single points is dropped and counted in
/// the warnings.
/// \throws BadInput Ref (an image of an unknown camera; no observation fits), Value (poses, naming
///         the image), Path (image names that leave the folder), and as the readers in
///         colmap_model.h.
/// Source: COLMAP documentation, "Output format"; poses are cam_from_world.
Scene read_colmap(const SceneRoot& root);

/// The scene of a model in memory.
/// \param photographs  the folder they lie in, relative to the scene
/// \throws BadInput as read_colmap()
Scene scene_of_colmap(const SceneRoot& root,
                      const ColmapModel& model,
                      const std::filesystem::path& photographs = ".");

}  // namespace cgs
