// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/photo_quality.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libcgs/core/order_statistics.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

constexpr int kTaps = 9;  // of the filter that blurs once more

Raster<float> luma(const ColorImage& image) {
  Raster<float> out(image.width, image.height, 0.0f);
  for (size_t i = 0; i < image.data.size(); ++i) {
    out.data[i] = image.data[i].dot(Eigen::Vector3f(0.299f, 0.587f, 0.114f));
  }
  return out;
}

// Sums of the differences of neighbours along lines, and of what another blur takes of them.
struct Variation {
  double all = 0, lost = 0;

  double blur() const { return all > 0 ? (all - lost) / all : 0; }
};

// \param at  at(k) is the k-th of the values on a line
template <typename At>
void add_line(int length, const At& at, std::vector<float>& blurred, Variation& sum) {
  constexpr int kReach = kTaps / 2;
  blurred.resize(static_cast<size_t>(length));
  for (int k = 0; k < length; ++k) {
    float total = 0;
    for (int d = -kReach; d <= kReach; ++d) total += at(std::clamp(k + d, 0, length - 1));
    blurred[static_cast<size_t>(k)] = total / kTaps;
  }
  for (int k = 1; k < length; ++k) {
    const auto i = static_cast<size_t>(k);
    const double own = std::abs(at(k) - at(k - 1));
    const double after = std::abs(blurred[i] - blurred[i - 1]);
    sum.all += own;
    sum.lost += std::max(0.0, own - after);
  }
}

}  // namespace

double blur_effect(const ColorImage& image) {
  const Raster<float> gray = luma(image);
  std::vector<float> blurred;
  Variation along_rows;
  for (int y = 0; y < gray.height; ++y) {
    add_line(
        gray.width, [&](int x) { return gray(x, y); }, blurred, along_rows);
  }
  Variation along_columns;
  for (int x = 0; x < gray.width; ++x) {
    add_line(
        gray.height, [&](int y) { return gray(x, y); }, blurred, along_columns);
  }
  return std::max(along_rows.blur(), along_columns.blur());
}

PhotoQuality photo_quality(const ColorImage& image) {
  constexpr float kLargest = 254.5f / 255;
  constexpr float kSmallest = 1.5f / 255;
  PhotoQuality out;
  out.blur = blur_effect(image);
  double light = 0;
  size_t burnt = 0;
  size_t black = 0;
  for (const Eigen::Vector3f& c : image.data) {
    light +=
        double(linear_from_srgb(c.x()) + linear_from_srgb(c.y()) + linear_from_srgb(c.z())) / 3;
    burnt += c.maxCoeff() > kLargest ? 1 : 0;
    black += c.maxCoeff() < kSmallest ? 1 : 0;
  }
  const auto count = static_cast<double>(std::max(size_t{1}, image.data.size()));
  constexpr double kDarkest = 1e-6;
  out.brightness = std::log2(std::max(kDarkest, light / count));
  out.burnt = static_cast<double>(burnt) / count;
  out.black = static_cast<double>(black) / count;
  return out;
}

std::vector<PhotoFlaws> photo_flaws(std::span<const PhotoQuality> photographs) {
  constexpr double kMoreBlurred = 0.12;
  constexpr double kStop = 1;
  constexpr double kMuch = 0.2;
  std::vector<PhotoFlaws> out(photographs.size());
  if (photographs.empty()) return out;
  std::vector<double> blur;
  std::vector<double> brightness;
  for (const PhotoQuality& photograph : photographs) {
    blur.push_back(photograph.blur);
    brightness.push_back(photograph.brightness);
  }
  const double usual_blur = median_of(std::move(blur));
  const double usual_brightness = median_of(std::move(brightness));
  for (size_t i = 0; i < out.size(); ++i) {
    out[i].stops = photographs[i].brightness - usual_brightness;
    out[i].is_blurred = photographs[i].blur > usual_blur + kMoreBlurred;
    out[i].is_off_exposure = std::abs(out[i].stops) >= kStop;
    out[i].is_burnt = photographs[i].burnt > kMuch;
  }
  return out;
}

}  // namespace cgs
