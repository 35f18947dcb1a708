// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/photograph_index.h"

#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;

PhotographIndex::PhotographIndex(const SceneRoot& root) {
  for (const std::string folder : {"images", "."}) {
    if (!is_folder(root.folder / folder)) continue;
    for (const fs::path& file : image_files(root, folder)) {
      files_.emplace(file.filename().string(), file);
      stems_.emplace(file.stem().string(), file);
    }
  }
}

fs::path PhotographIndex::take(std::string_view name) {
  fs::path file = find(name);
  if (file.empty()) return file;
  const auto [owner, is_new] = taken_.emplace(file, name);
  if (is_new) return file;
  throw BadInput(Defect::Ref,
                 file,
                 "is the photograph of two cameras, \"" + owner->second + "\" and \"" +
                     std::string(name) + "\"; give every photograph a name of its own");
}

fs::path PhotographIndex::find(std::string_view name) const {
  const std::string file(name.substr(name.find_last_of("/\\") + 1));  // npos + 1 is 0
  if (const auto found = files_.find(file); found != files_.end()) return found->second;
  // "IMG.0012" is a stem, "IMG_0012.tif" may stand for a JPEG made of it.
  if (const auto found = stems_.find(file); found != stems_.end()) return found->second;
  const fs::path path(file);
  const auto found = has_image_extension(path) ? stems_.find(path.stem().string()) : stems_.end();
  return found != stems_.end() ? found->second : fs::path();
}

}  // namespace cgs
