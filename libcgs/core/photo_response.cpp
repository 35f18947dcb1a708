// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/photo_response.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

// Of linear_from_srgb(), for values >= 0.
float srgb_slope(float coded) {
  return coded <= 0.04045f ? 1 / 12.92f : 2.4f / 1.055f * std::pow((coded + 0.055f) / 1.055f, 1.4f);
}

}  // namespace

double squared_radius(double x, double y, int width, int height) {
  const double dx = x - 0.5 * width;
  const double dy = y - 0.5 * height;
  return 4 * (dx * dx + dy * dy) / (double(width) * width + double(height) * height);
}

float coded_luminance(const Eigen::Vector3f& color) {
  if (color.x() == color.y() && color.y() == color.z()) return color.x();
  return srgb_from_linear(luminance_weights().dot(color.unaryExpr(&linear_from_srgb)));
}

float coded_luminance(const Eigen::Vector3f& color, Eigen::Vector3f& derivative) {
  const Eigen::Vector3f bright = color.cwiseMax(0.0f);
  const float luminance =
      srgb_from_linear(luminance_weights().dot(bright.unaryExpr(&linear_from_srgb)));
  for (int c = 0; c < 3; ++c) {
    derivative[c] = luminance_weights()[c] * srgb_slope(bright[c]) / srgb_slope(luminance);
  }
  return luminance;
}

ColorImage in_grey(const ColorImage& image) {
  ColorImage out = image;
  tbb::parallel_for(size_t(0), out.data.size(), [&](size_t i) {
    out.data[i].setConstant(coded_luminance(image.data[i]));
  });
  return out;
}

void apply_response(ColorImage& image, const PhotoResponse& response) {
  if (response.is_grey) image = in_grey(image);
  PhotoResponse rest = response;
  rest.is_grey = false;
  if (rest == PhotoResponse{}) return;
  const auto gamma = static_cast<float>(rest.gamma);
  const Eigen::Matrix3f matrix = rest.matrix.cast<float>();
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const double r2 = squared_radius(x + 0.5, y + 0.5, image.width, image.height);
      const auto factor =
          static_cast<float>(std::exp(rest.vignette.x() * r2 + rest.vignette.y() * r2 * r2));
      const Eigen::Vector3f light = image(x, y).unaryExpr(
          [&](float c) { return std::pow(std::max(0.0f, linear_from_srgb(c)), gamma); });
      image(x, y) = (factor * (matrix * light)).cwiseMax(0.0f).unaryExpr(&srgb_from_linear);
    }
  });
}

}  // namespace cgs
