// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scan_border.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr float kSameTone = 0.06f;  // largest difference of a channel within a border
constexpr int kRim = 2;             // [pixels] where border and picture mix

/// A picture as seen from one of its sides: line 0 lies outermost.
class FromSide {
 public:
  FromSide(const ColorImage& image, int side) : image_(image), side_(side) {}

  int lines() const { return is_row() ? image_.height : image_.width; }
  int length() const { return is_row() ? image_.width : image_.height; }
  const Eigen::Vector3f& at(int line, int along) const {
    const int across = side_ % 2 == 0 ? line : lines() - 1 - line;
    return is_row() ? image_(along, across) : image_(across, along);
  }

 private:
  bool is_row() const { return side_ >= 2; }

  const ColorImage& image_;
  int side_;  // left, right, top, bottom
};

bool is_same_tone(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return (a - b).cwiseAbs().maxCoeff() <= kSameTone;
}

Eigen::Vector3f outermost_tone(const FromSide& side) {
  Eigen::Vector3f out;
  for (int c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (int i = 0; i < side.length(); ++i) values.push_back(side.at(0, i)[c]);
    out[c] = median(values);
  }
  return out;
}

// Share of a line that is of a tone.
double share_of_tone(const FromSide& side, int line, const Eigen::Vector3f& tone) {
  int same = 0;
  for (int i = 0; i < side.length(); ++i) same += is_same_tone(side.at(line, i), tone) ? 1 : 0;
  return double(same) / side.length();
}

// Lines of one tone from a side on that end at a step; 0 = it has no border.
int border_width(const FromSide& side) {
  constexpr double kWhole = 0.99;       // of a line: dust and dents are of another tone
  constexpr double kPicture = 0.5;      // of a line that may still be of that tone beyond the step
  constexpr double kMostOfSide = 0.25;  // of the picture
  const Eigen::Vector3f tone = outermost_tone(side);
  const int farthest = static_cast<int>(kMostOfSide * side.lines());
  int width = 0;
  while (width <= farthest && share_of_tone(side, width, tone) >= kWhole) ++width;
  if (width < 2 || width > farthest) return 0;
  // A wall that gets darker leaves the tone as well, but not at once.
  const int beyond = std::min(width + kRim, side.lines() - 1);
  int same = 0;
  for (int i = 0; i < side.length(); ++i) {
    same += is_same_tone(side.at(beyond, i), side.at(width - 1, i)) ? 1 : 0;
  }
  return same <= kPicture * side.length() ? width : 0;
}

// Masks what is of the border's tone and reached from it, around the corner of the picture.
void mask_rounded_corner(const ColorImage& image,
                         const std::pair<int, int>& corner,
                         const std::pair<int, int>& inwards,
                         MaskMap& usable) {
  constexpr double kLargest = 0.15;  // of the smaller side
  const Eigen::Vector3f tone =
      image(std::clamp(corner.first - inwards.first, 0, image.width - 1),
            std::clamp(corner.second - inwards.second, 0, image.height - 1));
  const int reach = static_cast<int>(kLargest * std::min(image.width, image.height));
  for (int j = 0; j < reach; ++j) {
    const int y = corner.second + j * inwards.second;
    int run = 0;
    while (run < reach && image.contains(corner.first + run * inwards.first, y) &&
           is_same_tone(image(corner.first + run * inwards.first, y), tone)) {
      ++run;
    }
    if (run == 0 || run == reach) return;
    for (int i = 0; i < std::min(run + kRim, reach); ++i) {
      const int x = corner.first + i * inwards.first;
      if (image.contains(x, y)) usable(x, y) = 0;
    }
  }
}

}  // namespace

ScanBorder find_scan_border(const ColorImage& image) {
  constexpr int kSmallest = 16;  // [pixels]
  if (image.width < kSmallest || image.height < kSmallest) return {};
  std::array<int, 4> width = {};
  for (int side = 0; side < 4; ++side) {
    width.at(static_cast<size_t>(side)) = border_width(FromSide(image, side));
  }
  const auto sides = std::count_if(width.begin(), width.end(), [](int w) { return w > 0; });
  if (sides < 2) return {};
  return {width[0], width[1], width[2], width[3]};
}

void mask_scan_border(const ColorImage& image, MaskMap& usable) {
  const ScanBorder border = find_scan_border(image);
  if (border == ScanBorder{}) return;
  if (usable.empty()) usable = MaskMap(image.width, image.height, 1);
  const auto widened = [](int width) { return width > 0 ? width + kRim : 0; };
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const bool is_inside = x >= widened(border.left) && x < image.width - widened(border.right) &&
                             y >= widened(border.top) && y < image.height - widened(border.bottom);
      if (!is_inside) usable(x, y) = 0;
    }
  }
  for (const int right : {0, 1}) {
    for (const int bottom : {0, 1}) {
      const bool has_both = (right != 0 ? border.right : border.left) > 0 &&
                            (bottom != 0 ? border.bottom : border.top) > 0;
      if (!has_both) continue;
      mask_rounded_corner(image,
                          {right != 0 ? image.width - 1 - border.right : border.left,
                           bottom != 0 ? image.height - 1 - border.bottom : border.top},
                          {right != 0 ? -1 : 1, bottom != 0 ? -1 : 1},
                          usable);
    }
  }
}

}  // namespace cgs
