// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"

namespace cgs::patch_depth_test {
namespace {

// In the words of the header.
double reference(const Raster<double>& depth, const DepthMap& given, bool is_disparity) {
  double sum = 0;
  int patches = 0;
  for (int top = 0; top < depth.height; top += 16) {
    for (int left = 0; left < depth.width; left += 16) {
      ++patches;
      std::vector<double> own, other;
      for (int y = top; y < std::min(top + 16, depth.height); ++y) {
        for (int x = left; x < std::min(left + 16, depth.width); ++x) {
          if (std::isnan(given(x, y)) || std::isnan(depth(x, y))) continue;
          own.push_back(is_disparity ? 1 / depth(x, y) : depth(x, y));
          other.push_back(double(given(x, y)));
        }
      }
      const auto n = double(own.size());
      if (n < 8) continue;
      for (auto* values : {&own, &other}) {
        double mean = 0;
        double square = 0;
        for (const double v : *values) mean += v / n;
        for (const double v : *values) square += (v - mean) * (v - mean) / n;
        for (double& v : *values) v = (v - mean) / std::sqrt(square);
      }
      for (size_t k = 0; k < own.size(); ++k) sum += std::pow(own[k] - other[k], 2) / n;
    }
  }
  return sum / patches;
}

TEST(PatchDepth, EqualsItsDefinitionAndHasItsDerivatives) {
  DepthMap depth = test::noise_raster(37, 21, 1, 0.5f, 1.5f);
  DepthMap given = test::noise_raster(37, 21, 2, 0.5f, 1.5f);
  for (size_t i = 0; i < given.data.size(); i += 7) given.data[i] = std::nanf("");
  for (size_t i = 3; i < given.data.size(); i += 13) depth.data[i] = std::nanf("");
  const Raster<double> at = test::doubled(depth);
  for (const bool is_disparity : {false, true}) {
    Raster<float> gradient;
    const double value = patch_depth(depth, given, is_disparity, 5, gradient);
    EXPECT_NEAR(value, 5 * reference(at, given, is_disparity), 1e-6);
    test::expect_gradient(gradient, at, [&](const Raster<double>& moved) {
      return 5 * reference(moved, given, is_disparity);
    });
  }
}

TEST(PatchDepth, IsZeroForAnyScaleAndOffsetOfTheTruth) {
  const DepthMap depth = test::noise_raster(32, 32, 1, 0.5f, 1.5f);
  for (const bool is_disparity : {false, true}) {
    DepthMap given = depth;
    for (float& g : given.data) g = 7 * (is_disparity ? 1 / g : g) - 3;
    Raster<float> gradient;
    EXPECT_NEAR(patch_depth(depth, given, is_disparity, 1, gradient), 0, 1e-6);
  }
}

// A wall with a relief of one in a hundred before another a long way off: over the whole picture
// the relief is nothing, within a patch it is all there is.
TEST(PatchDepth, BringsBackARelief) {
  DepthMap truth(64, 32, 1.0f);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      const float relief = 0.01f * std::sin(0.7f * float(x)) * std::sin(0.6f * float(y));
      truth(x, y) = (x < 32 ? 1.0f : 5.0f) * (1 + relief);
    }
  }
  DepthMap given = truth;
  for (float& g : given.data) g = 2 * g + 1;
  const Raster<float> noise = test::noise_raster(64, 32, 4, -0.003f, 0.003f);
  DepthMap depth = truth;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) depth(x, y) = (x < 32 ? 1.0f : 5.0f) * (1 + noise(x, y));
  }
  Raster<float> gradient;
  const double before = patch_depth(depth, given, false, 1, gradient);
  EXPECT_GT(before, 1.5);
  for (int step = 0; step < 400; ++step) {
    gradient = {};
    patch_depth(depth, given, false, 1, gradient);
    for (size_t i = 0; i < depth.data.size(); ++i) {
      const float z = depth.data[i];
      depth.data[i] -= 5e-3f * z * z * gradient.data[i];
    }
  }
  gradient = {};
  EXPECT_LT(patch_depth(depth, given, false, 1, gradient), 0.1 * before);
}

TEST(PatchDepth, OfWeightZeroTouchesNothingAndOfFlatDepthIsNothing) {
  const DepthMap flat(20, 20, 1.0f);
  const DepthMap given = test::noise_raster(20, 20, 1, 0, 1);
  Raster<float> gradient;
  EXPECT_EQ(patch_depth(given, given, false, 0, gradient), 0);
  EXPECT_TRUE(gradient.empty());
  EXPECT_EQ(patch_depth(flat, given, false, 1, gradient), 0);
  EXPECT_EQ(gradient.data, std::vector<float>(400, 0));
}

TEST(PatchDepth, IsTheSameForAnyNumberOfThreads) {
  const DepthMap depth = test::noise_raster(61, 497, 1, 0.5f, 1.5f);
  const DepthMap given = test::noise_raster(61, 497, 2, 0.5f, 1.5f);
  Raster<float> first;
  const double expected = patch_depth(depth, given, false, 1, first);
  test::for_thread_counts([&] {
    Raster<float> gradient;
    EXPECT_EQ(patch_depth(depth, given, false, 1, gradient), expected);
    EXPECT_EQ(gradient.data, first.data);
  });
}

TEST(PatchDepth, RefusesUnequalSizes) {
  Raster<float> gradient;
  EXPECT_THROW(patch_depth(DepthMap(4, 5, 1.0f), DepthMap(5, 4, 1.0f), false, 1, gradient),
               InvalidInput);
}

}  // namespace
}  // namespace cgs::patch_depth_test
