// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cgs {

/// The folder a data set lives in, and whether what it names may lie elsewhere.
struct SceneRoot {
  std::filesystem::path folder;
  bool allow_external = false;  ///< Follow links and absolute paths that leave the folder.
};

/// Where a path written inside a data set leads; the file itself need not exist.
///
/// Empty names, NUL bytes and URLs are always refused; absolute paths, ".." and symbolic links
/// that leave the folder only without allow_external.
/// \param named_in  file that contains the name, for the message
/// \throws BadInput Path
std::filesystem::path resolve_in_scene(const SceneRoot& root,
                                       std::string_view name,
                                       const std::filesystem::path& named_in);

/// A path relative to the folder of a data set: by its names if they lead there, else with links
/// resolved. Outside of the folder it is absolute with allow_external, and nothing without. The
/// folder itself is the empty path.
std::optional<std::filesystem::path> path_in_scene(const SceneRoot& root,
                                                   const std::filesystem::path& path);

/// Folders of a data set, as path_in_scene(), that may hold files for the photographs in the folder
/// `photographs`, in the order to look: those called `name` in it and in each folder above it,
/// there with the same subfolders (masks/rig1 for images/rig1).
std::vector<std::filesystem::path> companion_folders(const SceneRoot& root,
                                                     const std::filesystem::path& photographs,
                                                     const std::string& name);

/// A name as programs on Windows write paths, with '/' for every backslash.
std::string with_slashes(std::string name);

/// True for a relative path without ".." in it.
bool stays_below(const std::filesystem::path& path);

/// True if something has that name, even a link that leads nowhere: reading it tells what is wrong.
/// Never throws, not for names that are too long or links that go round.
bool is_present(const std::filesystem::path& path);

/// True if the path leads to a folder; never throws.
bool is_folder(const std::filesystem::path& path);

/// The name of a folder, however the path to it is written: "photos/", ".", "../photos".
std::string folder_name(const std::filesystem::path& path);

/// The names of what lies in a folder, sorted; empty if it cannot be listed.
std::vector<std::string> sorted_entries(const std::filesystem::path& folder);

/// The ending of a name with its dot, ASCII letters in lower case.
std::string lower_extension(const std::filesystem::path& path);

/// A name without the differences that file systems and programs make of it: letter case folded,
/// in Unicode normal form C, so that names which macOS wrote equal those of others. What is no
/// UTF-8 stays as it is.
/// Source: Unicode Standard Annex 15; Unicode 3.13, caseless matching.
std::string folded_name(std::string_view name);

/// True for the extensions of image files: .png .jpg .jpeg .tif .tiff .webp, in any case.
bool has_image_extension(const std::filesystem::path& path);

/// True for the extensions of glTF: .glb .gltf, in any case.
bool has_gltf_extension(const std::filesystem::path& path);

/// True if a folder holds image files directly, but for those that macOS hides ("._a.jpg").
bool holds_images(const std::filesystem::path& folder);

/// The image files directly inside a folder, sorted by file name.
/// \throws BadInput Open if the folder cannot be listed, Path as resolve_in_scene(); LimitError
std::vector<std::filesystem::path> image_files(const SceneRoot& root, const std::string& subfolder);

}  // namespace cgs
