// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "io/bytes/scene_path.h"
#include "io/images/exif.h"

namespace cgs {

/// A photograph whose camera is not known.
struct PhotoFile {
  std::filesystem::path path;
  ImageSize size;       ///< Upright.
  int orientation = 1;  ///< As exif_orientation().
  LensHint hint;
};

/// The folder of a scene that its photographs lie in, relative to it: itself (".") if it holds
/// image files; else images/ or the only one that does, but for those of masks, depth, copies and
/// results. Empty if there is none, or none of several that could be told from the others.
std::filesystem::path folder_of_photographs(const std::filesystem::path& scene);

/// True if the folder has a folder_of_photographs() and no file that states cameras in a layout
/// that read_scene() knows.
bool is_photographs(const std::filesystem::path& folder);

/// What people should know of files in a folder that are not read: raw photographs and other kinds
/// of pictures, and cameras of other programs, one line each; empty if there are none.
std::vector<std::string> unread_files(const std::filesystem::path& folder);

/// The image files directly in the folder_of_photographs() of a scene, in the order of their names.
/// \throws BadInput Path (names with control characters, links that leave the folder), and as
///         image_size(); LimitError
std::vector<PhotoFile> list_photographs(const SceneRoot& root);

}  // namespace cgs
