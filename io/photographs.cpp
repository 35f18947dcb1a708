// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/photographs.h"

#include <algorithm>

#include "io/orientation.h"
#include "io/scene_layouts.h"

namespace cgs {

namespace fs = std::filesystem;

bool is_photographs(const fs::path& folder) {
  if (!is_folder(folder) || layout_of(folder) != nullptr) return false;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (has_image_extension(entry->path())) return true;
  }
  return false;
}

std::vector<PhotoFile> list_photographs(const SceneRoot& root) {
  std::vector<PhotoFile> out;
  for (const fs::path& path : image_files(root, ".")) {
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
