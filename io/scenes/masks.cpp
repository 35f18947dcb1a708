// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/masks.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "io/images/exif.h"
#include "io/scenes/orientation.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> mask_folders(const SceneRoot& root, const fs::path& photograph) {
  return companion_folders(root, photograph.parent_path(), "masks");
}

// The mask of a photograph that lies turned in its file, as the upright photograph.
ColorImage upright(const ColorImage& mask,
                   const fs::path& file,
                   int orientation,
                   const ImageSize& size) {
  const int own = exif_orientation(file);
  if (own != 1) return turned(mask, own);
  const bool lies_as_stored = mask.width == size.height && mask.height == size.width &&
                              size.width != size.height && orientation >= 5;
  return lies_as_stored ? turned(mask, orientation) : mask;
}

// From which brightness on pixels may be used.
float brightness_of_use(const ColorImage& mask) {
  constexpr float kHalf = 0.5f;
  constexpr float kOne = 1.0f / 255;
  float brightest = 0;
  for (const Eigen::Vector3f& color : mask.data) brightest = std::max(brightest, color.mean());
  const bool has_classes = brightest > 0 && brightest < 1.5f * kOne;
  return has_classes ? kHalf * brightest : kHalf;
}

}  // namespace

MaskIndex::MaskIndex(SceneRoot root) : root_(std::move(root)) {}

const MaskIndex::Folder& MaskIndex::listed(const std::string& folder) {
  const auto [place, is_new] = folders_.try_emplace(folder);
  if (!is_new) return place->second;
  for (const fs::path& file : image_files(root_, folder)) {
    place->second.files.emplace(file.filename().string(), file);
    place->second.stems.emplace(file.stem().string(), file);
  }
  return place->second;
}

fs::path MaskIndex::mask_of(const fs::path& photograph) {
  for (const fs::path& name : mask_folders(root_, photograph)) {
    const Folder& folder = listed(name.string());
    const auto file = folder.files.find(photograph.filename().string() + ".png");
    if (file != folder.files.end()) return file->second;
    const auto same_stem = folder.stems.find(photograph.stem().string());
    if (same_stem != folder.stems.end()) return same_stem->second;
  }
  return {};
}

bool MaskIndex::lacks(const fs::path& photograph) {
  return !mask_folders(root_, photograph).empty() && mask_of(photograph).empty();
}

void find_masks(const SceneRoot& root, Scene& scene) {
  MaskIndex masks(root);
  for (View& view : scene.views) {
    if (view.image_path.empty() || !view.mask_path.empty()) continue;
    view.mask_path = masks.mask_of(view.image_path);
  }
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.mask_path.empty() || !may_lie_turned(view)) continue;
    if (exif_orientation(view.mask_path) != 1) continue;
    scene.warnings.push_back("the photograph of view " + printable(view.name) +
                             " lies turned in its file and is shown upright; its mask is taken to "
                             "be upright already");
  }
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (!view.mask_path.empty() || !masks.lacks(view.image_path)) continue;
    scene.warnings.push_back("there are masks, but none for view " + printable(view.name) +
                             ", of which everything is used");
  }
}

void apply_mask(const View& view, const ImageSize& size, MaskMap& usable) {
  const fs::path& file = view.mask_path;
  if (file.empty()) return;
  ColorImage mask = read_image(file);
  if (view.orientation != 1) mask = upright(mask, file, view.orientation, size);
  if (mask.width != size.width || mask.height != size.height) {
    throw BadInput(Defect::Mismatch,
                   file,
                   "the mask has " + std::to_string(mask.width) + " x " +
                       std::to_string(mask.height) + " pixels, its photograph " +
                       std::to_string(size.width) + " x " + std::to_string(size.height));
  }
  if (usable.empty()) usable = MaskMap(size.width, size.height, 1);
  const float bright = brightness_of_use(mask);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (mask.data[i].mean() < bright) usable.data[i] = 0;
  }
  const auto is_set = [](uint8_t set) { return set != 0; };
  if (std::all_of(usable.data.begin(), usable.data.end(), is_set)) usable = MaskMap();
}

}  // namespace cgs
