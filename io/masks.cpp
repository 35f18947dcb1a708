// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/masks.h"

#include <algorithm>
#include <string>
#include <vector>

#include "io/image.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

// Folders of the scene that may hold the masks of a photograph, as seen from the root.
std::vector<std::string> mask_folders(const SceneRoot& root, const fs::path& photograph) {
  std::vector<std::string> out;
  std::error_code ignored;  // what cannot be resolved stays as it is, and is not found
  const fs::path top = fs::weakly_canonical(root.folder, ignored);
  const fs::path folder = fs::weakly_canonical(photograph.parent_path(), ignored);
  for (const fs::path& candidate : {folder / "masks", folder.parent_path() / "masks"}) {
    const std::string below = candidate.lexically_relative(top).generic_string();
    const bool is_below = !below.empty() && !below.starts_with("..");
    if (is_below && is_folder(candidate)) out.push_back(below);
  }
  return out;
}

}  // namespace

std::optional<fs::path> mask_file(const SceneRoot& root, const fs::path& photograph) {
  const std::string whole_name = photograph.filename().string() + ".png";
  for (const std::string& folder : mask_folders(root, photograph)) {
    std::optional<fs::path> same_stem;
    for (const fs::path& file : image_files(root, folder)) {
      if (file.filename() == whole_name) return file;
      if (!same_stem && file.stem() == photograph.stem()) same_stem = file;
    }
    if (same_stem) return same_stem;
  }
  return std::nullopt;
}

bool lacks_mask(const SceneRoot& root, const fs::path& photograph) {
  return !mask_folders(root, photograph).empty() && !mask_file(root, photograph);
}

void apply_mask(
    const SceneRoot& root, const fs::path& photograph, int width, int height, MaskMap& usable) {
  const auto file = mask_file(root, photograph);
  if (!file) return;
  const ColorImage mask = read_image(*file);
  if (mask.width != width || mask.height != height) {
    throw BadInput(Defect::Mismatch,
                   *file,
                   "the mask has " + std::to_string(mask.width) + " x " +
                       std::to_string(mask.height) + " pixels, its photograph " +
                       std::to_string(width) + " x " + std::to_string(height));
  }
  if (usable.empty()) usable = MaskMap(width, height, 1);
  constexpr float kDark = 0.5f;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (mask.data[i].mean() < kDark) usable.data[i] = 0;
  }
  const auto is_set = [](uint8_t set) { return set != 0; };
  if (std::all_of(usable.data.begin(), usable.data.end(), is_set)) usable = MaskMap();
}

}  // namespace cgs
