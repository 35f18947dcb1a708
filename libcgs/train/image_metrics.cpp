// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/image_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/halved.h"

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

// The two factors of SSIM in each channel of one window.
struct Similarity {
  Eigen::Array3d luminance;
  Eigen::Array3d structure;  // with contrast
};

Similarity similarity(const Moments& m) {
  constexpr double kC1 = 0.01 * 0.01;
  constexpr double kC2 = 0.03 * 0.03;
  const Eigen::Array3d product = m[0] * m[1];
  const Eigen::Array3d squares = m[0] * m[0] + m[1] * m[1];
  // In double a flat patch leaves about 1e-16 here, far below kC2, but it may be negative.
  const Eigen::Array3d variances = (m[2] + m[3] - squares).max(0.0);
  const Eigen::Array3d covariance = m[4] - product;
  return {(2 * product + kC1) / (squares + kC1), (2 * covariance + kC2) / (variances + kC2)};
}

// Windowed averages of two images, along rows first.
class WindowAverages {
 public:
  WindowAverages(const ColorImage& a, const ColorImage& b)
      : along_rows_(a.width, a.height, zero()) {
    tbb::parallel_for(0, a.height, [&](int y) {
      for (int x = 0; x < a.width; ++x) {
        const Moments here = moments_of(a(x, y), b(x, y));
        const int last = std::min(a.width - 1, x + kRadius);
        for (int to = std::max(0, x - kRadius); to <= last; ++to) {
          add(along_rows_(to, y), weights_[x - to + kRadius], here);
        }
      }
    });
  }

  Moments at(int x, int y) const {
    Moments sum = zero();
    const int last = std::min(along_rows_.height - 1, y + kRadius);
    for (int from = std::max(0, y - kRadius); from <= last; ++from) {
      add(sum, weights_[from - y + kRadius], along_rows_(x, from));
    }
    return sum;
  }

 private:
  std::array<double, kTaps> weights_ = window();
  Raster<Moments> along_rows_;
};

// Means over the windows that lie inside both images.
struct Means {
  Eigen::Array3d ssim = Eigen::Array3d::Zero();
  Eigen::Array3d structure = Eigen::Array3d::Zero();
};

Means means_inside(const ColorImage& a, const ColorImage& b) {
  const WindowAverages averages(a, b);
  std::vector<Means> rows(a.height);
  tbb::parallel_for(kRadius, a.height - kRadius, [&](int y) {
    for (int x = kRadius; x < a.width - kRadius; ++x) {
      const Similarity here = similarity(averages.at(x, y));
      rows[y].ssim += here.luminance * here.structure;
      rows[y].structure += here.structure;
    }
  });
  Means sum;
  for (const Means& row : rows) {
    sum.ssim += row.ssim;
    sum.structure += row.structure;
  }
  const double count = double(a.width - 2 * kRadius) * (a.height - 2 * kRadius);
  return {sum.ssim / count, sum.structure / count};
}

bool holds_a_window(int width, int height) { return std::min(width, height) >= kTaps; }

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
  const WindowAverages averages(a, b);
  return mean_over(a, use, [&](int x, int y) {
    const Similarity here = similarity(averages.at(x, y));
    return (here.luminance * here.structure).sum();
  });
}

double ms_ssim(const ColorImage& a, const ColorImage& b) {
  check_sizes(a, b, nullptr);
  constexpr std::array<double, 5> kWeights = {0.0448, 0.2856, 0.3001, 0.2363, 0.1333};
  if (!holds_a_window(a.width, a.height)) return std::numeric_limits<double>::quiet_NaN();
  ColorImage fine_a = a;
  ColorImage fine_b = b;
  Eigen::Array3d product = Eigen::Array3d::Ones();
  double weights = 0;
  for (size_t level = 0; level < kWeights.size(); ++level) {
    weights += kWeights[level];
    const Means means = means_inside(fine_a, fine_b);
    const bool coarsest =
        level + 1 == kWeights.size() || !holds_a_window(fine_a.width / 2, fine_a.height / 2);
    const Eigen::Array3d& mean = coarsest ? means.ssim : means.structure;
    product *= mean.max(0.0).pow(kWeights[level]);  // a power of a negative mean is not real
    if (coarsest) break;
    fine_a = halved(fine_a);
    fine_b = halved(fine_b);
  }
  return product.pow(1 / weights).mean();
}

}  // namespace cgs
