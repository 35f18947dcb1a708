// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

using Planes = std::array<cv::Mat, 3>;  // CV_32F

constexpr double kPixelsPerDegree = 0.7 * (3840 / 0.7) * std::numbers::pi / 180;

// Linear sRGB to XYZ over that of the white of D65, so that white is (1, 1, 1). IEC 61966-2-1.
const Eigen::Matrix3f& xyz_from_rgb() {
  static const Eigen::Matrix3f matrix = [] {
    Eigen::Matrix3d m;
    m << 0.4123907993, 0.3575843394, 0.1804807884,  //
        0.2126390059, 0.7151686788, 0.0721923154,   //
        0.0193308187, 0.1191947798, 0.9505321522;
    const Eigen::Vector3d white = m.rowwise().sum();
    return Eigen::Matrix3f((white.cwiseInverse().asDiagonal() * m).cast<float>());
  }();
  return matrix;
}

const Eigen::Matrix3f& rgb_from_xyz() {
  static const Eigen::Matrix3f matrix = xyz_from_rgb().inverse();
  return matrix;
}

// Lightness and two opponent colours, linear in light: YCxCz of the paper.
Eigen::Vector3f opponent_from_linear(const Eigen::Vector3f& rgb) {
  const Eigen::Vector3f xyz = xyz_from_rgb() * rgb;
  return {116 * xyz.y() - 16, 500 * (xyz.x() - xyz.y()), 200 * (xyz.y() - xyz.z())};
}

Eigen::Vector3f linear_from_opponent(const Eigen::Vector3f& opponent) {
  const float y = (opponent.x() + 16) / 116;
  return rgb_from_xyz() * Eigen::Vector3f(y + opponent.y() / 500, y, y - opponent.z() / 200);
}

// CIE L*a*b*, its a and b scaled by the lightness: colours show less in the dark (Hunt 1952).
Eigen::Vector3f hunt_lab_from_linear(const Eigen::Vector3f& rgb) {
  const auto curve = [](float t) {
    constexpr float kDelta = 6.0F / 29;
    if (t > kDelta * kDelta * kDelta) return std::cbrt(t);
    return t / (3 * kDelta * kDelta) + 4.0F / 29;
  };
  const Eigen::Vector3f f = (xyz_from_rgb() * rgb).unaryExpr(curve);
  const float lightness = 116 * f.y() - 16;
  const float share = 0.01F * lightness;
  return {lightness, share * 500 * (f.x() - f.y()), share * 200 * (f.y() - f.z())};
}

// HyAB distance to the power that the paper takes.
double color_distance(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const Eigen::Vector3f d = a - b;
  return std::pow(std::abs(d.x()) + std::hypot(d.y(), d.z()), 0.7);
}

// Distances up to 0.4 of the largest fill [0, 0.95], the rest is squeezed into what is left.
double spread_distance(double distance) {
  static const double largest =
      color_distance(hunt_lab_from_linear({0, 1, 0}), hunt_lab_from_linear({0, 0, 1}));
  constexpr double kShare = 0.95;
  const double knee = 0.4 * largest;
  if (distance < knee) return kShare / knee * distance;
  return kShare + (distance - knee) / (largest - knee) * (1 - kShare);
}

cv::Mat gaussian(double variance, int radius) {
  cv::Mat out(1, 2 * radius + 1, CV_64F);
  for (int k = -radius; k <= radius; ++k) {
    out.at<double>(k + radius) = std::exp(-k * k / (2 * variance));
  }
  return out;
}

cv::Mat filtered(const cv::Mat& plane, const cv::Mat& along_x, const cv::Mat& along_y) {
  cv::Mat out;
  cv::sepFilter2D(plane, out, CV_32F, along_x, along_y, {-1, -1}, 0, cv::BORDER_REPLICATE);
  return out;
}

// What the eye resolves of one channel: a sum of weight * sqrt(pi / b) exp(-(pi x)^2 / b), x in
// degrees, that sums to 1. The radius is that of the widest of all channels.
struct Blur {
  double weight;
  double b;
};

cv::Mat resolved(const cv::Mat& plane, const std::vector<Blur>& blurs) {
  constexpr double kWidest = 0.04;
  const auto variance = [](double b) {
    return b / (2 * std::numbers::pi * std::numbers::pi) * kPixelsPerDegree * kPixelsPerDegree;
  };
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(variance(kWidest))));
  cv::Mat out = cv::Mat::zeros(plane.size(), CV_32F);
  double sum = 0;
  for (const Blur& blur : blurs) {
    const cv::Mat kernel = gaussian(variance(blur.b), radius);
    const double weight = blur.weight * std::sqrt(std::numbers::pi / blur.b);
    sum += weight * std::pow(cv::sum(kernel)[0], 2);
    out += weight * filtered(plane, kernel, kernel);
  }
  return out / sum;
}

Planes opponent_planes(const ColorImage& image) {
  Planes out;
  for (cv::Mat& plane : out) plane.create(image.height, image.width, CV_32F);
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3f linear =
          image(x, y).cwiseMax(0).cwiseMin(1).unaryExpr(&linear_from_srgb);
      const Eigen::Vector3f value = opponent_from_linear(linear);
      for (int c = 0; c < 3; ++c) out[static_cast<size_t>(c)].at<float>(y, x) = value[c];
    }
  });
  return out;
}

Planes resolved_planes(const Planes& opponent) {
  return {resolved(opponent[0], {{1, 0.0047}}),
          resolved(opponent[1], {{1, 0.0053}}),
          resolved(opponent[2], {{34.1, 0.04}, {13.5, 0.025}})};
}

Eigen::Vector3f hunt_lab_at(const Planes& resolved, int x, int y) {
  const Eigen::Vector3f opponent(
      resolved[0].at<float>(y, x), resolved[1].at<float>(y, x), resolved[2].at<float>(y, x));
  return hunt_lab_from_linear(linear_from_opponent(opponent).cwiseMax(0).cwiseMin(1));
}

// Lengths of the first and the second derivatives of lightness in [0, 1], at the width at which
// the eye sees edges and points.
struct Features {
  cv::Mat edges;
  cv::Mat points;
};

// The taps above zero sum to 1 with those of `across`, those below to -1.
cv::Mat balanced(cv::Mat along, const cv::Mat& across) {
  double above = 0;
  double below = 0;
  for (int k = 0; k < along.cols; ++k) {
    const double tap = along.at<double>(k);
    (tap > 0 ? above : below) += tap;
  }
  const double sum = cv::sum(across)[0];
  for (int k = 0; k < along.cols; ++k) {
    double& tap = along.at<double>(k);
    tap /= (tap > 0 ? above : -below) * sum;
  }
  return along;
}

Features features_of(const cv::Mat& lightness) {
  constexpr double kSigma = 0.5 * 0.082 * kPixelsPerDegree;
  const int radius = static_cast<int>(std::ceil(3 * kSigma));
  const cv::Mat smooth = gaussian(kSigma * kSigma, radius);
  cv::Mat first = smooth.clone();
  cv::Mat second = smooth.clone();
  for (int k = -radius; k <= radius; ++k) {
    first.at<double>(k + radius) *= -k;
    second.at<double>(k + radius) *= k * k / (kSigma * kSigma) - 1;
  }
  const auto length = [&](const cv::Mat& kernel) {
    cv::Mat out;
    cv::magnitude(filtered(lightness, kernel, smooth), filtered(lightness, smooth, kernel), out);
    return out;
  };
  return {length(balanced(first, smooth)), length(balanced(second, smooth))};
}

}  // namespace

double flip(const ColorImage& a, const ColorImage& b, const MaskMap* use) {
  const auto fits = [&a](const auto& other) {
    return other.width == a.width && other.height == a.height;
  };
  require(!a.empty() && fits(b) && (use == nullptr || fits(*use)),
          "flip: pictures and mask must have one size",
          b.width);
  const Planes opponent_a = opponent_planes(a);
  const Planes opponent_b = opponent_planes(b);
  const Planes seen_a = resolved_planes(opponent_a);
  const Planes seen_b = resolved_planes(opponent_b);
  const Features features_a = features_of((opponent_a[0] + 16) / 116);
  const Features features_b = features_of((opponent_b[0] + 16) / 116);
  std::vector<double> sums(static_cast<size_t>(a.height), 0);
  std::vector<int> counts(static_cast<size_t>(a.height), 0);
  tbb::parallel_for(0, a.height, [&](int y) {  // rows apart, then in order: threads do not matter
    for (int x = 0; x < a.width; ++x) {
      if (use != nullptr && (*use)(x, y) == 0) continue;
      const double color =
          spread_distance(color_distance(hunt_lab_at(seen_a, x, y), hunt_lab_at(seen_b, x, y)));
      const auto change = [&](const cv::Mat& of_a, const cv::Mat& of_b) {
        return std::abs(of_a.at<float>(y, x) - of_b.at<float>(y, x));
      };
      const double feature = std::sqrt(std::max(change(features_a.edges, features_b.edges),
                                                change(features_a.points, features_b.points)) /
                                       std::numbers::sqrt2);
      sums[static_cast<size_t>(y)] += std::pow(color, 1 - std::min(feature, 1.0));
      ++counts[static_cast<size_t>(y)];
    }
  });
  double sum = 0;
  double count = 0;
  for (size_t y = 0; y < sums.size(); ++y) {
    sum += sums[y];
    count += counts[y];
  }
  require(count > 0, "flip: number of pixels in use must be > 0", count);
  return sum / count;
}

}  // namespace cgs
