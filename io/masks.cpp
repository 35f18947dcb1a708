// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/masks.h"

#include <algorithm>
#include <string>
#include <vector>

#include "io/exif.h"
#include "io/orientation.h"
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
  const auto add = [&](const fs::path& candidate) {
    const std::string below = candidate.lexically_relative(top).lexically_normal().generic_string();
    const bool is_below = !below.empty() && !below.starts_with("..");
    if (is_below && is_folder(candidate)) out.push_back(below);
  };
  add(folder / "masks");
  fs::path within;  // the folder above which masks lie, in which the photograph does
  for (fs::path above = folder; above != top && above.has_relative_path();) {
    add(above.parent_path() / "masks" / within);
    within = within.empty() ? above.filename() : above.filename() / within;
    above = above.parent_path();
  }
  return out;
}

// The mask of a photograph that lies turned in its file, as the upright photograph.
ColorImage upright(ColorImage mask, const fs::path& file, int orientation, const ImageSize& size) {
  const int own = exif_orientation(file);
  if (own != 1) return turned(mask, own);
  const bool lies_as_stored = mask.width == size.height && mask.height == size.width &&
                              size.width != size.height && orientation >= 5;
  return lies_as_stored ? turned(mask, orientation) : mask;
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

std::optional<fs::path> mask_file(const SceneRoot& root, const View& view) {
  if (!view.mask_path.empty()) return view.mask_path;
  return mask_file(root, view.image_path);
}

bool lacks_mask(const SceneRoot& root, const View& view) {
  return !mask_folders(root, view.image_path).empty() && !mask_file(root, view);
}

void apply_mask(const SceneRoot& root, const View& view, const ImageSize& size, MaskMap& usable) {
  const auto file = mask_file(root, view);
  if (!file) return;
  ColorImage mask = read_image(*file);
  if (view.orientation != 1) mask = upright(std::move(mask), *file, view.orientation, size);
  if (mask.width != size.width || mask.height != size.height) {
    throw BadInput(Defect::Mismatch,
                   *file,
                   "the mask has " + std::to_string(mask.width) + " x " +
                       std::to_string(mask.height) + " pixels, its photograph " +
                       std::to_string(size.width) + " x " + std::to_string(size.height));
  }
  if (usable.empty()) usable = MaskMap(size.width, size.height, 1);
  constexpr float kDark = 0.5f;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (mask.data[i].mean() < kDark) usable.data[i] = 0;
  }
  const auto is_set = [](uint8_t set) { return set != 0; };
  if (std::all_of(usable.data.begin(), usable.data.end(), is_set)) usable = MaskMap();
}

}  // namespace cgs
