// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/orientation.h"

#include "io/images/exif.h"
#include "io/scenes/masks.h"
#include "io/scenes/scan_border.h"

namespace cgs {

namespace {

constexpr int kUpright = 1;
constexpr int kFirstTransposed = 5;  // from here on rows of the file are columns of the picture

template <typename T>
Raster<T> turned_raster(const Raster<T>& stored, int orientation) {
  if (orientation == kUpright || stored.empty()) return stored;
  const ImageSize from = {stored.width, stored.height};
  const ImageSize to = turned(from, orientation);
  Raster<T> out(to.width, to.height, stored.data.front());
  for (int y = 0; y < to.height; ++y) {
    for (int x = 0; x < to.width; ++x) {
      const Eigen::Vector2d at = stored_pixel({x, y}, from, orientation);
      out(x, y) = stored(static_cast<int>(at.x()), static_cast<int>(at.y()));
    }
  }
  return out;
}

}  // namespace

ColorImage turned(const ColorImage& stored, int orientation) {
  return turned_raster(stored, orientation);
}

MaskMap turned(const MaskMap& stored, int orientation) {
  return turned_raster(stored, orientation);
}

Raster<float> turned(const Raster<float>& stored, int orientation) {
  return turned_raster(stored, orientation);
}

ImageSize turned(const ImageSize& stored, int orientation) {
  if (orientation < kFirstTransposed) return stored;
  return {stored.height, stored.width};
}

Eigen::Vector2d stored_pixel(const Eigen::Vector2d& upright,
                             const ImageSize& stored,
                             int orientation) {
  const double x = upright.x();
  const double y = upright.y();
  const int last_x = stored.width - 1;
  const int last_y = stored.height - 1;
  switch (orientation) {
    case 2:
      return {last_x - x, y};
    case 3:
      return {last_x - x, last_y - y};
    case 4:
      return {x, last_y - y};
    case 5:
      return {y, x};
    case 6:
      return {y, last_y - x};
    case 7:
      return {last_x - y, last_y - x};
    case 8:
      return {last_x - y, x};
    default:
      return {x, y};
  }
}

ImageSize shown_size(const View& view) {
  return turned(image_size(view.image_path), exif_orientation(view.image_path));
}

bool may_lie_turned(const View& view) {
  if (view.orientation == kUpright) return false;
  const ImageSize size = photograph_size(view);
  return view.orientation < kFirstTransposed || size.width == size.height;
}

std::optional<Eigen::Vector2d> picked_pixel(const View& view, const Eigen::Vector2d& shown) {
  const ImageSize size = shown_size(view);
  const bool is_inside = shown.x() >= 0 && shown.y() >= 0 && shown.x() <= size.width - 1 &&
                         shown.y() <= size.height - 1;
  if (!is_inside) return std::nullopt;
  // Cameras that came with the photographs do not turn as viewers do.
  const int orientation = exif_orientation(view.image_path);
  if (orientation == view.orientation) return shown;
  return stored_pixel(shown, image_size(view.image_path), orientation);
}

ImageSize photograph_size(const View& view) {
  return turned(image_size(view.image_path), view.orientation);
}

ColorImage read_photograph(const View& view) {
  return turned(read_image(view.image_path), view.orientation);
}

ColorImage read_photograph(const View& view, MaskMap& usable) {
  ColorImage image = turned(read_image(view.image_path, &usable), view.orientation);
  usable = turned(usable, view.orientation);
  apply_mask(view, {image.width, image.height}, usable);
  if (view.may_have_border) mask_scan_border(image, usable);
  return image;
}

}  // namespace cgs
