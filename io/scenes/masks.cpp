// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/masks.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "io/images/exif.h"
#include "io/scenes/orientation.h"
#include "io/scenes/view_sizes.h"
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
    place->second.folded[folded_name(file.stem().string())].push_back(file);
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
    for (const fs::path& name_of_mask : {photograph.filename(), photograph.stem()}) {
      const auto close = folder.folded.find(folded_name(name_of_mask.string()));
      if (close == folder.folded.end()) continue;
      if (close->second.size() == 1) return close->second.front();
      throw BadInput(Defect::Ref,
                     close->second[0],
                     "and " + printable(close->second[1]) + " may both be the mask of " +
                         printable(photograph.filename()) + "; rename one of them");
    }
  }
  return {};
}

bool MaskIndex::lacks(const fs::path& photograph) {
  return !mask_folders(root_, photograph).empty() && mask_of(photograph).empty();
}

namespace {

// What is damaged is told of when it is decoded.
bool has_mask_of_other_size(const View& view) {
  if (view.mask_path.empty() || view.image_path.empty()) return false;
  const auto sides = [](const ImageSize& size) { return std::minmax(size.width, size.height); };
  try {
    const ImageSize mask = image_size(view.mask_path);
    const ImageSize photograph = photograph_size(view);
    return sides(mask) != sides(photograph);  // a mask may lie turned
  } catch (const BadInput&) {
    return false;
  }
}

void tell_of_other_sizes(Scene& scene) {
  const auto count = std::count_if(scene.input.begin(), scene.input.end(), [&](int i) {
    return has_mask_of_other_size(scene.views[static_cast<size_t>(i)]);
  });
  if (count == 0) return;
  scene.notes.push_back(std::to_string(count) + (count == 1 ? " mask is" : " masks are") +
                        " of another size than the photograph; each pixel takes the nearest");
}

}  // namespace

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
  tell_of_other_sizes(scene);
}

void apply_mask(const View& view, const ImageSize& size, MaskMap& usable) {
  const fs::path& file = view.mask_path;
  if (file.empty()) return;
  ColorImage mask = read_image(file);
  if (view.orientation != 1) mask = upright(mask, file, view.orientation, size);
  if (!have_same_shape(mask.width, mask.height, size.width, size.height)) {
    throw BadInput(Defect::Mismatch,
                   file,
                   "the mask has " + size_text(mask.width, mask.height) +
                       " pixels, its photograph " + size_text(size.width, size.height) +
                       ", which is another shape");
  }
  if (usable.empty()) usable = MaskMap(size.width, size.height, 1);
  const float bright = brightness_of_use(mask);
  const auto nearest = [](int i, int of, int wanted) {
    return static_cast<int>((2 * int64_t{i} + 1) * wanted / (2 * int64_t{of}));
  };
  for (int y = 0; y < size.height; ++y) {
    const int row = nearest(y, size.height, mask.height);
    for (int x = 0; x < size.width; ++x) {
      if (mask(nearest(x, size.width, mask.width), row).mean() < bright) usable(x, y) = 0;
    }
  }
  const auto is_set = [](uint8_t set) { return set != 0; };
  if (std::all_of(usable.data.begin(), usable.data.end(), is_set)) usable = MaskMap();
}

}  // namespace cgs
