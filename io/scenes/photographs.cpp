// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/photographs.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "io/scenes/orientation.h"
#include "io/scenes/photograph_index.h"
#include "io/scenes/scene_layouts.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 20> kUnreadPictures = {
    ".dng", ".nef", ".cr2", ".cr3", ".crw", ".arw", ".raf", ".orf", ".rw2", ".pef",
    ".srw", ".3fr", ".iiq", ".x3f", ".bmp", ".gif", ".jxl", ".psd", ".mov", ".mp4"};
constexpr std::array<std::string_view, 5> kUnreadCameras = {
    "bundle.out", "sfm_data.json", "reconstruction.json", "cameras.sfm", "model.nvm"};

template <size_t N>
bool is_one_of(const std::array<std::string_view, N>& known, const std::string& name) {
  return std::find(known.begin(), known.end(), name) != known.end();
}

}  // namespace

fs::path folder_of_photographs(const fs::path& scene) {
  if (holds_images(scene)) return ".";
  const fs::path usual = "images";
  if (holds_images(scene / usual)) return usual;
  std::vector<fs::path> found;
  for (const std::string& name : sorted_entries(scene)) {
    if (!holds_no_photographs(name) && holds_images(scene / name)) found.emplace_back(name);
  }
  return found.size() == 1 ? found.front() : fs::path();
}

bool is_photographs(const fs::path& folder) {
  return is_folder(folder) && layout_of(folder) == nullptr &&
         !folder_of_photographs(folder).empty();
}

std::vector<std::string> unread_files(const fs::path& folder) {
  std::vector<std::string> pictures;
  std::vector<std::string> out;
  for (const std::string& name : sorted_entries(folder)) {
    if (is_one_of(kUnreadPictures, lower_extension(name))) pictures.push_back(name);
    if (!is_one_of(kUnreadCameras, name)) continue;
    out.push_back(printable(name) +
                  " is not read: cameras come from COLMAP, transforms.json and others that the "
                  "guide lists");
  }
  if (pictures.empty()) return out;
  out.push_back(first_few(pictures) + (pictures.size() > 1 ? " are" : " is") +
                " not read: develop or convert photographs to JPEG, PNG or TIFF");
  return out;
}

std::vector<PhotoFile> list_photographs(const SceneRoot& root) {
  std::vector<PhotoFile> out;
  const fs::path folder = folder_of_photographs(root.folder);
  if (folder.empty()) return out;
  for (const fs::path& path : image_files(root, folder.string())) {
    const std::string name = path.filename().string();
    const bool is_plain = std::none_of(
        name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; });
    if (!is_plain) throw BadInput(Defect::Path, path, "the name holds control characters");
    const ImageSize stored = image_size(path);
    const int orientation = exif_orientation(path);
    out.push_back({path, turned(stored, orientation), orientation, lens_hint(path, stored)});
  }
  return out;
}

}  // namespace cgs
