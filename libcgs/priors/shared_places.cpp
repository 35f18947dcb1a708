// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/shared_places.h"

#include <algorithm>
#include <cmath>

#include "libcgs/core/exposure.h"
#include "libcgs/core/srgb.h"
#include "libcgs/priors/shown_pixel.h"

namespace cgs {

namespace {

ShownPlace place_at(const ColorImage& light, int x, int y) {
  return {light(x, y).cast<double>(), squared_radius(x + 0.5, y + 0.5, light.width, light.height)};
}

double coded_mean(const Eigen::Vector3d& light) {
  double sum = 0;
  for (const double l : light) sum += double{srgb_from_linear(static_cast<float>(l))} / 3;
  return sum;
}

}  // namespace

ColorImage smooth_light(const View& view) {
  const ColorImage& image = view.image;
  const Eigen::Vector3f unknown = Eigen::Vector3f::Constant(std::nanf(""));
  ColorImage light(image.width, image.height, unknown);
  for (size_t i = 0; i < image.data.size(); ++i) {
    const Eigen::Vector3f& color = image.data[i];
    if (!tells_exposure(color) || !view.is_usable(i)) continue;
    light.data[i] = color.unaryExpr(&linear_from_srgb);
  }
  ColorImage out(image.width, image.height, unknown);
  for (int y = 1; y + 1 < image.height; ++y) {
    for (int x = 1; x + 1 < image.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int k = 0; k < 9; ++k) sum += light(x + k % 3 - 1, y + k / 3 - 1);
      out(x, y) = sum / 9;
    }
  }
  return out;
}

std::vector<SharedPlace> shared_places(const LitView& a, const LitView& b) {
  constexpr int kLeastStep = 4;         // [pixels]
  constexpr double kMostPlaces = 2500;  // of a pair of views, in each direction
  const Camera& camera = a.view.camera;
  const double pixels = static_cast<double>(camera.width) * camera.height;
  const int step = std::max(kLeastStep, static_cast<int>(std::sqrt(pixels / kMostPlaces)));
  std::vector<SharedPlace> out;
  for (int y = step / 2; y < camera.height; y += step) {
    for (int x = step / 2; x < camera.width; x += step) {
      if (a.priors.origin(x, y) != DepthOrigin::Measured) continue;
      const Eigen::Vector3d point =
          camera.unproject(x + 0.5, y + 0.5, double{a.priors.depth(x, y)});
      const auto there = confirmed_pixel(b.view.camera, b.priors, point);
      if (!there) continue;
      SharedPlace place{place_at(a.light, x, y), place_at(b.light, there->x(), there->y()), 0};
      place.coded = 0.5 * (coded_mean(place.a.light) + coded_mean(place.b.light));
      if (std::isfinite(place.coded)) out.push_back(place);
    }
  }
  return out;
}

}  // namespace cgs
