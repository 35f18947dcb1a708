// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/photo_response.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/exposure.h"

namespace cgs::core_photo_response_test {
namespace {

using Eigen::Vector3f;

double linear(double coded) {
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}
double coded(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}
double luminance(const Eigen::Vector3d& color) {
  return coded(0.2126 * linear(color.x()) + 0.7152 * linear(color.y()) +
               0.0722 * linear(color.z()));
}

ColorImage colors() {
  ColorImage image(20, 10, Vector3f::Zero());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image(x, y) = {0.1f + 0.04f * float(x), 0.2f + 0.05f * float(y), 0.7f - 0.02f * float(x)};
    }
  }
  return image;
}

TEST(PhotoResponse, OfNothingChangesNoBit) {
  View view;
  view.image = colors();
  apply_exposure(view);
  EXPECT_EQ(view.image.data, colors().data);
}

TEST(PhotoResponse, IsAPowerAFactorByTheDistanceFromTheMiddleAndAMatrix) {
  PhotoResponse response;
  response.gamma = 1.2;
  response.vignette = {0.3, -0.1};
  response.matrix << 0.9, 0.1, 0, 0.05, 0.9, 0.05, 0, 0.2, 0.8;
  ColorImage image = colors();
  apply_response(image, response);
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(10, 5), std::pair(19, 3)}) {
    const double r2 = (std::pow(x + 0.5 - 10, 2) + std::pow(y + 0.5 - 5, 2)) / 125;
    Eigen::Vector3d light;
    for (int c = 0; c < 3; ++c) light[c] = std::pow(linear(double{colors()(x, y)[c]}), 1.2);
    light = std::exp(0.3 * r2 - 0.1 * r2 * r2) * (response.matrix * light);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image(x, y)[c], coded(light[c]), 1e-5) << x << c;
  }
}

TEST(PhotoResponse, OfAGreyPhotographKeepsItsLuminance) {
  PhotoResponse response;
  response.is_grey = true;
  ColorImage image = colors();
  apply_response(image, response);
  for (size_t i = 0; i < image.data.size(); i += 7) {
    const double expected = luminance(colors().data[i].cast<double>());
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.data[i][c], expected, 1e-5);
  }
  const ColorImage once = image;
  apply_response(image, response);
  EXPECT_EQ(image.data, once.data);
}

TEST(CodedLuminance, HasTheDerivativeOfItsDifferences) {
  for (const Vector3f& color : {Vector3f(0.2f, 0.5f, 0.8f),
                                Vector3f(0.9f, 0.02f, 0.3f),
                                Vector3f(0.01f, 0.02f, 0.03f),
                                Vector3f(1.2f, 0.7f, 0.4f)}) {
    Vector3f derivative;
    EXPECT_NEAR(coded_luminance(color, derivative), luminance(color.cast<double>()), 1e-5);
    for (int c = 0; c < 3; ++c) {
      constexpr double kStep = 1e-5;
      Eigen::Vector3d up = color.cast<double>();
      Eigen::Vector3d down = up;
      up[c] += kStep;
      down[c] -= kStep;
      EXPECT_NEAR(derivative[c], (luminance(up) - luminance(down)) / (2 * kStep), 1e-3);
    }
  }
  Vector3f derivative;
  EXPECT_EQ(coded_luminance(Vector3f(-0.5f, 0, 0), derivative), 0);
  EXPECT_TRUE(derivative.allFinite());
}

}  // namespace
}  // namespace cgs::core_photo_response_test
