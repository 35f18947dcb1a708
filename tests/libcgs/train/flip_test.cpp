// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/flip.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"

namespace cgs::flip_test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kPpd = 3840 * kPi / 180;

ColorImage flat(const Eigen::Vector3f& color) { return {40, 30, color}; }

ColorImage noise(int width, int height, unsigned seed) {
  ColorImage image(width, height, Eigen::Vector3f::Zero());
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform;
  for (Eigen::Vector3f& pixel : image.data) {
    pixel = {uniform(random), uniform(random), uniform(random)};
  }
  return image;
}

// The definition, pixel by pixel in double, with whole two-dimensional kernels.
class Reference {
 public:
  double at(const ColorImage& a, const ColorImage& b, int x, int y) const {
    const double distance = hyab(seen(a, x, y), seen(b, x, y));
    const double most = hyab(hunt({0, 1, 0}), hunt({0, 0, 1}));
    const double knee = 0.4 * most;
    const double color =
        distance < knee ? 0.95 / knee * distance : 0.95 + (distance - knee) / (most - knee) * 0.05;
    const double change = std::max(std::abs(edge(a, x, y) - edge(b, x, y)),
                                   std::abs(point(a, x, y) - point(b, x, y)));
    return std::pow(color, 1 - std::sqrt(change / std::sqrt(2.0)));
  }

 private:
  static double linear(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  }
  static Eigen::Vector3d linear_at(const ColorImage& image, int x, int y) {
    const auto& p = image(std::clamp(x, 0, image.width - 1), std::clamp(y, 0, image.height - 1));
    return {linear(p.x()), linear(p.y()), linear(p.z())};
  }
  // Primaries and white as rational numbers, from chromaticities.
  static Eigen::Matrix3d matrix() {
    Eigen::Matrix3d primaries;
    primaries << 0.64 / 0.33, 0.30 / 0.60, 0.15 / 0.06, 1, 1, 1, 0.03 / 0.33, 0.10 / 0.60,
        0.79 / 0.06;
    const Eigen::Vector3d white(0.3127 / 0.3290, 1, 0.3583 / 0.3290);
    const Eigen::Vector3d gain = primaries.inverse() * white;
    const Eigen::Matrix3d xyz = primaries * gain.asDiagonal();
    return white.cwiseInverse().asDiagonal() * xyz;
  }
  static Eigen::Vector3d opponent(const Eigen::Vector3d& rgb) {
    const Eigen::Vector3d xyz = matrix() * rgb;
    return {116 * xyz.y() - 16, 500 * (xyz.x() - xyz.y()), 200 * (xyz.y() - xyz.z())};
  }
  static Eigen::Vector3d hunt(const Eigen::Vector3d& rgb) {
    const Eigen::Vector3d xyz = matrix() * rgb;
    const auto f = [](double t) {
      return t > std::pow(6.0 / 29, 3) ? std::cbrt(t) : t * 841 / 108 + 4.0 / 29;
    };
    const double l = 116 * f(xyz.y()) - 16;
    return {
        l, 0.01 * l * 500 * (f(xyz.x()) - f(xyz.y())), 0.01 * l * 200 * (f(xyz.y()) - f(xyz.z()))};
  }
  static double hyab(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::pow(std::abs(a.x() - b.x()) + (a - b).tail<2>().norm(), 0.7);
  }
  static Eigen::Vector3d seen(const ColorImage& image, int x, int y) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
    for (int j = -10; j <= 10; ++j) {
      for (int i = -10; i <= 10; ++i) {
        const double square = (i * i + j * j) / (kPpd * kPpd);
        const auto lobe = [&](double a, double b) {
          return a * std::sqrt(kPi / b) * std::exp(-kPi * kPi * square / b);
        };
        const Eigen::Vector3d weight(
            lobe(1, 0.0047), lobe(1, 0.0053), lobe(34.1, 0.04) + lobe(13.5, 0.025));
        sum += weight.cwiseProduct(opponent(linear_at(image, x + i, y + j)));
        weights += weight;
      }
    }
    const Eigen::Vector3d o = sum.cwiseQuotient(weights);
    const double luminance = (o.x() + 16) / 116;
    const Eigen::Vector3d xyz(luminance + o.y() / 500, luminance, luminance - o.z() / 200);
    const Eigen::Vector3d rgb = matrix().inverse() * xyz;
    return hunt(rgb.cwiseMax(0).cwiseMin(1));
  }
  static double slope(const ColorImage& image,
                      int x,
                      int y,
                      const std::function<double(double, double)>& tap) {
    double above = 0;
    double below = 0;
    for (int j = -9; j <= 9; ++j) {
      for (int i = -9; i <= 9; ++i) (tap(i, j) > 0 ? above : below) += tap(i, j);
    }
    double sum = 0;
    for (int j = -9; j <= 9; ++j) {
      for (int i = -9; i <= 9; ++i) {
        const double weight = tap(i, j) > 0 ? tap(i, j) / above : -tap(i, j) / below;
        sum += weight * (opponent(linear_at(image, x + i, y + j)).x() + 16) / 116;
      }
    }
    return sum;
  }
  static constexpr double kSigma = 0.5 * 0.082 * kPpd;
  static double bell(double i, double j) {
    return std::exp(-(i * i + j * j) / (2 * kSigma * kSigma));
  }
  static double edge(const ColorImage& image, int x, int y) {
    return std::hypot(slope(image, x, y, [](double i, double j) { return -i * bell(i, j); }),
                      slope(image, x, y, [](double i, double j) { return -j * bell(i, j); }));
  }
  static double point(const ColorImage& image, int x, int y) {
    const auto tap = [](double along, double across) {
      return (along * along / (kSigma * kSigma) - 1) * bell(along, across);
    };
    return std::hypot(slope(image, x, y, [&](double i, double j) { return tap(i, j); }),
                      slope(image, x, y, [&](double i, double j) { return tap(j, i); }));
  }
};

TEST(Flip, PicturesThatAreTheSameDoNotDiffer) {
  const ColorImage image = noise(40, 30, 1);
  EXPECT_EQ(flip(image, image), 0);
}

TEST(Flip, GreenAndBlueDifferMost) { EXPECT_NEAR(flip(flat({0, 1, 0}), flat({0, 0, 1})), 1, 1e-5); }

TEST(Flip, WhiteAndBlackAreAHundredStepsOfLightnessApart) {
  // Green is (87.73, -75.61, 72.97) and blue (32.30, 25.58, -34.84) in L*, Hunt's a*, b*.
  const double most = std::pow(87.73 - 32.30 + std::hypot(75.61 + 25.58, 72.97 + 34.84), 0.7);
  const double distance = std::pow(100, 0.7);
  const double expected = 0.95 + 0.05 * (distance - 0.4 * most) / (0.6 * most);
  EXPECT_NEAR(flip(flat({1, 1, 1}), flat({0, 0, 0})), expected, 1e-4);
}

TEST(Flip, EachPixelIsAsDefined) {
  const ColorImage a = noise(24, 20, 2);
  ColorImage b = noise(24, 20, 3);
  for (size_t i = 0; i < b.data.size(); ++i) b.data[i] = 0.7F * a.data[i] + 0.3F * b.data[i];
  b(12, 10) = {1, 1, 1};  // a point, to be seen as one
  const Reference reference;
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(12, 10), std::pair(23, 7)}) {
    MaskMap one(24, 20, 0);
    one(x, y) = 1;
    EXPECT_NEAR(flip(a, b, &one), reference.at(a, b, x, y), 2e-4) << x << " " << y;
  }
}

TEST(Flip, IsSymmetricAndClamps) {
  const ColorImage a = noise(40, 30, 4);
  ColorImage b = noise(40, 30, 5);
  EXPECT_EQ(flip(a, b), flip(b, a));
  ColorImage beyond = b;
  b(3, 4) = {1, 0, 1};
  beyond(3, 4) = {7, -2, 1.5F};
  EXPECT_EQ(flip(a, b), flip(a, beyond));
}

TEST(Flip, DoesNotDependOnTheNumberOfThreads) {
  const ColorImage a = noise(61, 47, 6);
  const ColorImage b = noise(61, 47, 7);
  const double many = flip(a, b);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(flip(a, b), many);
}

TEST(Flip, RefusesPicturesThatCannotBeCompared) {
  const ColorImage a = noise(40, 30, 8);
  EXPECT_THROW(flip(a, noise(30, 40, 8)), InvalidInput);
  EXPECT_THROW(flip({}, {}), InvalidInput);
  const MaskMap none(40, 30, 0);
  EXPECT_THROW(flip(a, a, &none), InvalidInput);
}

}  // namespace
}  // namespace cgs::flip_test
