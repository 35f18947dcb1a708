// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/image_metrics.h"

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"

namespace cgs::image_metrics_test {
namespace {

ColorImage flat(int width, int height, float value) {
  return {width, height, Eigen::Vector3f::Constant(value)};
}

ColorImage noise(int width, int height, unsigned seed) {
  ColorImage image = flat(width, height, 0);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform;
  for (Eigen::Vector3f& pixel : image.data) {
    pixel = {uniform(random), uniform(random), uniform(random)};
  }
  return image;
}

// One channel of the SSIM map at one pixel, from the definition: 121 weights, centred moments
// around the windowed mean of what lies inside the image (zero outside).
double reference_ssim(const ColorImage& a, const ColorImage& b, int x, int y, int channel) {
  double total = 0;
  for (int j = -5; j <= 5; ++j) {
    for (int i = -5; i <= 5; ++i) total += std::exp(-(i * i + j * j) / 4.5);
  }
  const auto average = [&](const auto& value) {
    double sum = 0;
    for (int j = -5; j <= 5; ++j) {
      for (int i = -5; i <= 5; ++i) {
        const bool inside = a.contains(x + i, y + j);
        const double p = inside ? double(a(x + i, y + j)[channel]) : 0;
        const double q = inside ? double(b(x + i, y + j)[channel]) : 0;
        sum += std::exp(-(i * i + j * j) / 4.5) / total * value(p, q);
      }
    }
    return sum;
  };
  const double ma = average([](double p, double) { return p; });
  const double mb = average([](double, double q) { return q; });
  const double va = average([&](double p, double) { return (p - ma) * (p - ma); });
  const double vb = average([&](double, double q) { return (q - mb) * (q - mb); });
  const double cov = average([&](double p, double q) { return (p - ma) * (q - mb); });
  return (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
}

TEST(Psnr, OfAConstantDifferenceIsKnown) {
  EXPECT_NEAR(psnr(flat(7, 5, 0.5f), flat(7, 5, 0.25f)), -20 * std::log10(0.25), 1e-12);
  EXPECT_NEAR(psnr(flat(7, 5, 0), flat(7, 5, 1)), 0, 1e-12);
}

TEST(Psnr, OfEqualImagesIsInfinite) {
  EXPECT_EQ(psnr(noise(7, 5, 1), noise(7, 5, 1)), std::numeric_limits<double>::infinity());
}

TEST(Psnr, CountsOnlyThePixelsInUse) {
  ColorImage a = flat(4, 3, 0.5f);
  const ColorImage b = flat(4, 3, 0.25f);
  MaskMap use(4, 3, 1);
  a(2, 1) = {9, 9, 9};
  use(2, 1) = 0;
  EXPECT_NEAR(psnr(a, b, &use), -20 * std::log10(0.25), 1e-12);
  EXPECT_LT(psnr(a, b), 0);
}

TEST(Psnr, KeepsItsDigitsOnALargeImage) {
  // 12 million small squares: a float sum would be off in the first decimal of the dB.
  const ColorImage a = flat(2000, 2000, 0);
  const ColorImage b = flat(2000, 2000, 1e-3f);
  EXPECT_NEAR(psnr(a, b), -20 * std::log10(double(1e-3f)), 1e-10);
}

TEST(Psnr, IsThatOfSquaresAddedInLongDouble) {
  const ColorImage a = noise(701, 499, 1);
  const ColorImage b = noise(701, 499, 2);
  long double sum = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const auto d = static_cast<long double>(a.data[i][c]) - b.data[i][c];
      sum += d * d;
    }
  }
  const long double mean = sum / (3.0L * static_cast<long double>(a.data.size()));
  EXPECT_NEAR(psnr(a, b) / static_cast<double>(-10 * std::log10(mean)), 1, 1e-12);
}

TEST(ImageMetrics, GiveTheSameBitsForAnyNumberOfThreads) {
  const ColorImage a = noise(411, 305, 1);
  const ColorImage b = noise(411, 305, 2);
  const auto all = [&] { return std::array{psnr(a, b), ssim(a, b), ms_ssim(a, b)}; };
  std::array<double, 3> expected{};
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    expected = all();
  }
  for (const size_t threads : {2, 3, 4}) {
    const tbb::global_control many(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(all(), expected) << threads;
  }
}

TEST(Ssim, OfEqualImagesIsOne) {
  EXPECT_NEAR(ssim(noise(20, 15, 1), noise(20, 15, 1)), 1, 1e-12);
  EXPECT_NEAR(ssim(flat(20, 15, 1), flat(20, 15, 1)), 1, 1e-12);
  EXPECT_NEAR(ssim(flat(20, 15, 0), flat(20, 15, 0)), 1, 1e-12);
}

TEST(Ssim, OfTwoFlatImagesIsTheLuminanceTerm) {
  // In the middle of a large image the window is full: (2ab + C1) / (a^2 + b^2 + C1).
  MaskMap middle(31, 31, 0);
  middle(15, 15) = 1;
  const double expected = (2 * 0.5 * 0.25 + 1e-4) / (0.25 + 0.0625 + 1e-4);
  EXPECT_NEAR(ssim(flat(31, 31, 0.5f), flat(31, 31, 0.25f), &middle), expected, 1e-12);
}

TEST(Ssim, EqualsTheDefinition) {
  for (const auto& [width, height] : {std::pair{23, 17}, {4, 30}, {1, 1}}) {
    const ColorImage a = noise(width, height, 2);
    ColorImage b = noise(width, height, 3);
    for (size_t p = 0; p < b.data.size(); ++p) b.data[p] = 0.7f * a.data[p] + 0.3f * b.data[p];
    MaskMap use(width, height, 0);
    double masked = 0;
    double count = 0;
    double all = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double here = 0;
        for (int c = 0; c < 3; ++c) here += reference_ssim(a, b, x, y, c) / 3;
        all += here;
        if ((x + 2 * y) % 3 != 0) continue;
        use(x, y) = 1;
        masked += here;
        ++count;
      }
    }
    EXPECT_NEAR(ssim(a, b), all / (width * height), 1e-12);
    EXPECT_NEAR(ssim(a, b, &use), masked / count, 1e-12);
  }
}

ColorImage half(const ColorImage& image) {
  ColorImage out = flat(image.width / 2, image.height / 2, 0);
  for (int y = 0; y < 2 * out.height; ++y) {
    for (int x = 0; x < 2 * out.width; ++x) out(x / 2, y / 2) += image(x, y) / 4;
  }
  return out;
}

// Mean over the windows inside the image of SSIM, or of its structure term, in one channel: the
// structure term is SSIM over the luminance term.
double reference_mean(const ColorImage& a, const ColorImage& b, int channel, bool structure) {
  double sum = 0;
  double count = 0;
  for (int y = 5; y < a.height - 5; ++y) {
    for (int x = 5; x < a.width - 5; ++x) {
      double ma = 0;
      double mb = 0;
      double total = 0;
      for (int k = 0; k < 121; ++k) {
        const int i = k % 11 - 5;
        const int j = k / 11 - 5;
        const double weight = std::exp(-(i * i + j * j) / 4.5);
        total += weight;
        ma += weight * double(a(x + i, y + j)[channel]);
        mb += weight * double(b(x + i, y + j)[channel]);
      }
      ma /= total;
      mb /= total;
      const double luminance = (2 * ma * mb + 1e-4) / (ma * ma + mb * mb + 1e-4);
      sum += reference_ssim(a, b, x, y, channel) / (structure ? luminance : 1);
      ++count;
    }
  }
  return sum / count;
}

TEST(MsSsim, EqualsTheDefinition) {
  // 57 pixels are halved to 28, 14 and 7: three levels; 12 pixels hold one.
  const std::vector<double> weights = {0.0448, 0.2856, 0.3001};
  for (const auto& [width, height, levels] : {std::tuple{70, 57, 3}, {12, 90, 1}}) {
    ColorImage a = noise(width, height, 2);
    ColorImage b = noise(width, height, 3);
    for (size_t p = 0; p < b.data.size(); ++p) {
      a.data[p].x() *= 0.5f;
      b.data[p] = 0.7f * a.data[p] + 0.3f * b.data[p];
    }
    const double sum = std::accumulate(weights.begin(), weights.begin() + levels, 0.0);
    const double value = ms_ssim(a, b);
    std::array<double, 3> product = {1, 1, 1};
    for (int level = 0; level < levels; ++level) {
      for (int c = 0; c < 3; ++c) {
        const double mean = reference_mean(a, b, c, level + 1 < levels);
        product[c] *= std::pow(mean, weights[level] / sum);
      }
      a = half(a);
      b = half(b);
    }
    EXPECT_NEAR(value, (product[0] + product[1] + product[2]) / 3, 1e-6);
  }
}

TEST(MsSsim, OfEqualImagesIsOne) {
  EXPECT_NEAR(ms_ssim(noise(200, 180, 1), noise(200, 180, 1)), 1, 1e-12);
  EXPECT_NEAR(ms_ssim(flat(30, 20, 0), flat(30, 20, 0)), 1, 1e-12);
}

TEST(MsSsim, OfTwoFlatImagesIsTheLuminanceOfTheCoarsestOfFiveLevels) {
  const double luminance = (2 * 0.5 * 0.25 + 1e-4) / (0.25 + 0.0625 + 1e-4);
  EXPECT_NEAR(ms_ssim(flat(176, 180, 0.5f), flat(176, 180, 0.25f)),
              std::pow(luminance, 0.1333 / 1.0001),
              1e-12);
  EXPECT_NEAR(ms_ssim(flat(175, 180, 0.5f), flat(175, 180, 0.25f)),
              std::pow(luminance, 0.2363 / (1.0001 - 0.1333)),
              1e-12);
}

TEST(MsSsim, OfANegativeIsZeroAndOfLessThanAWindowUnknown) {
  const ColorImage a = noise(40, 40, 1);
  ColorImage negative = a;
  for (Eigen::Vector3f& pixel : negative.data) pixel = Eigen::Vector3f::Ones() - pixel;
  EXPECT_EQ(ms_ssim(a, negative), 0);
  EXPECT_TRUE(std::isnan(ms_ssim(noise(40, 10, 1), noise(40, 10, 1))));
}

TEST(MsSsim, ForgivesNoiseAtFullSizeMoreThanSsim) {
  const ColorImage a = flat(200, 200, 0.5f);
  ColorImage b = noise(200, 200, 1);
  for (Eigen::Vector3f& pixel : b.data) pixel = 0.45f * Eigen::Vector3f::Ones() + 0.1f * pixel;
  EXPECT_GT(ms_ssim(a, b), ssim(a, b) + 0.1);
}

TEST(ImageMetrics, RefuseUnequalSizesAndEmptySelections) {
  const ColorImage a = flat(4, 3, 0);
  const MaskMap none(4, 3, 0);
  const MaskMap wrong(3, 4, 1);
  EXPECT_THROW(psnr(a, flat(3, 4, 0)), InvalidInput);
  EXPECT_THROW(ssim(a, flat(3, 4, 0)), InvalidInput);
  EXPECT_THROW(psnr(a, a, &none), InvalidInput);
  EXPECT_THROW(ssim(a, a, &wrong), InvalidInput);
  EXPECT_THROW(psnr({}, {}), InvalidInput);
  EXPECT_THROW(ms_ssim(a, flat(3, 4, 0)), InvalidInput);
  EXPECT_THROW(ms_ssim({}, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::image_metrics_test
