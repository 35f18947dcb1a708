// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/image_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr int kRadius = 5;
constexpr int kTaps = 2 * kRadius + 1;

void check_sizes(const ColorImage& a, const ColorImage& b, const MaskMap* use) {
  const auto fits = [&a](const auto& other) {
    return other.width == a.width && other.height == a.height;
  };
  require(!a.empty() && fits(b) && (use == nullptr || fits(*use)),
          "image metrics: images and mask must have one size",
          b.width);
}

// Mean over pixels in use of value(x, y), which returns a sum over the three channels. Rows are
// summed apart and then in order, so the result does not depend on the number of threads.
template <typename Value>
double mean_over(const ColorImage& image, const MaskMap* use, const Value& value) {
  std::vector<double> sums(image.height, 0);
  std::vector<double> counts(image.height, 0);
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      if (use != nullptr && (*use)(x, y) == 0) continue;
      sums[y] += value(x, y);
      counts[y] += 3;
    }
  });
  const double count = std::accumulate(counts.begin(), counts.end(), 0.0);
  require(count > 0, "image metrics: number of pixels in use must be > 0", count / 3);
  return std::accumulate(sums.begin(), sums.end(), 0.0) / count;
}

std::array<double, kTaps> window() {
  constexpr double kSigma = 1.5;
  std::array<double, kTaps> out{};
  for (int k = 0; k < kTaps; ++k) {
    out[k] = std::exp(-(k - kRadius) * (k - kRadius) / (2 * kSigma * kSigma));
  }
  const double sum = std::accumulate(out.begin(), out.end(), 0.0);
  for (double& weight : out) weight /= sum;
  return out;
}

// The five window averages that SSIM is made of: a, b, a^2, b^2, ab per channel.
using Moments = std::array<Eigen::Array3d, 5>;

Moments moments_of(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const Eigen::Array3d x = a.cast<double>();
  const Eigen::Array3d y = b.cast<double>();
  return {x, y, x * x, y * y, x * y};
}

void add(Moments& to, double weight, const Moments& from) {
  for (size_t k = 0; k < to.size(); ++k) to[k] += weight * from[k];
}

Moments zero() {
  Moments out;
  out.fill(Eigen::Array3d::Zero());
  return out;
}

// Sum over the channels of the SSIM of one window.
double ssim_sum(const Moments& m) {
  constexpr double kC1 = 0.01 * 0.01;
  constexpr double kC2 = 0.03 * 0.03;
  const Eigen::Array3d product = m[0] * m[1];
  const Eigen::Array3d squares = m[0] * m[0] + m[1] * m[1];
  // In double a flat patch leaves about 1e-16 here, far below kC2, but it may be negative.
  const Eigen::Array3d variances = (m[2] + m[3] - squares).max(0.0);
  const Eigen::Array3d covariance = m[4] - product;
  const Eigen::Array3d map =
      (2 * product + kC1) * (2 * covariance + kC2) / ((squares + kC1) * (variances + kC2));
  return map.sum();
}

}  // namespace

double psnr(const ColorImage& a, const ColorImage& b, const MaskMap* use) {
  check_sizes(a, b, use);
  const double mean_square = mean_over(a, use, [&](int x, int y) {
    return (a(x, y).cast<double>() - b(x, y).cast<double>()).squaredNorm();
  });
  return -10 * std::log10(mean_square);  // log10(0) = -infinity
}

double ssim(const ColorImage& a, const ColorImage& b, const MaskMap* use) {
  check_sizes(a, b, use);
  const std::array<double, kTaps> weights = window();
  Raster<Moments> along_rows(a.width, a.height, zero());
  tbb::parallel_for(0, a.height, [&](int y) {
    for (int x = 0; x < a.width; ++x) {
      const Moments here = moments_of(a(x, y), b(x, y));
      const int last = std::min(a.width - 1, x + kRadius);
      for (int to = std::max(0, x - kRadius); to <= last; ++to) {
        add(along_rows(to, y), weights[x - to + kRadius], here);
      }
    }
  });
  return mean_over(a, use, [&](int x, int y) {
    Moments sum = zero();
    const int last = std::min(a.height - 1, y + kRadius);
    for (int from = std::max(0, y - kRadius); from <= last; ++from) {
      add(sum, weights[from - y + kRadius], along_rows(x, from));
    }
    return ssim_sum(sum);
  });
}

}  // namespace cgs
