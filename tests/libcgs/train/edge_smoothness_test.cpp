// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"

namespace cgs::edge_smoothness_test {
namespace {

struct Completed {
  DepthMap depth, measured;
  ColorPlanes photograph;
};

// A third is measured, a few pixels have no depth.
Completed completed(int width, int height, unsigned seed) {
  Completed out{test::noise_raster(width, height, seed, 0.5f, 1.5f),
                DepthMap(width, height, std::nanf("")),
                test::noise_planes(width, height, seed + 1)};
  for (size_t i = 0; i < out.depth.data.size(); ++i) {
    if (i % 3 == 0) out.measured.data[i] = 1;
    if (i % 11 == 7) out.depth.data[i] = std::nanf("");
  }
  return out;
}

// In the words of the header.
double reference(const Completed& c, const Raster<double>& depth) {
  double sum = 0;
  for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
    for (int y = 0; y + dy < depth.height; ++y) {
      for (int x = 0; x + dx < depth.width; ++x) {
        const size_t i = c.depth.index(x, y);
        const size_t j = c.depth.index(x + dx, y + dy);
        if (std::isnan(depth.data[i]) || std::isnan(depth.data[j])) continue;
        if (!std::isnan(c.measured.data[i]) && !std::isnan(c.measured.data[j])) continue;
        double color = 0;
        for (const auto& plane : c.photograph) {
          color += std::abs(double(plane.data[i]) - double(plane.data[j])) / 3;
        }
        sum += std::exp(-10 * color) * std::abs(std::log(depth.data[i] / depth.data[j]));
      }
    }
  }
  return sum / double(depth.data.size());
}

TEST(EdgeSmoothness, EqualsItsDefinitionAndHasItsDerivatives) {
  Completed c = completed(17, 13, 3);
  const Raster<double> depth = test::doubled(c.depth);
  Raster<float> gradient;
  const double value = edge_smoothness(c.depth, c.photograph, c.measured, 5, gradient);
  EXPECT_NEAR(value, 5 * reference(c, depth), 1e-7);
  test::expect_gradient(
      gradient, depth, [&](const Raster<double>& moved) { return 5 * reference(c, moved); });
}

// Noise on completed depth either side of an edge in the photograph, and a step of depth there.
TEST(EdgeSmoothness, SmoothsCompletedDepthUpToAnEdgeOfThePhotograph) {
  constexpr int kSize = 24;
  Completed c{DepthMap(kSize, kSize, 1.0f),
              DepthMap(kSize, kSize, std::nanf("")),
              {Raster<float>(kSize, kSize, 0.2f),
               Raster<float>(kSize, kSize, 0.2f),
               Raster<float>(kSize, kSize, 0.2f)}};
  const Raster<float> noise = test::noise_raster(kSize, kSize, 5, -0.02f, 0.02f);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const bool right = x >= kSize / 2;
      for (auto& plane : c.photograph) plane(x, y) = right ? 0.9f : 0.2f;
      c.depth(x, y) = (right ? 1.5f : 1.0f) * (1 + noise(x, y));
    }
  }
  const auto roughness = [&](int first, int last) {
    double sum = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = first; x < last; ++x) {
        sum += std::abs(std::log(double(c.depth(x, y)) / double(c.depth(x + 1, y)))) / kSize;
      }
    }
    return sum / (last - first);
  };
  const double before = roughness(0, kSize / 2 - 1);
  for (int step = 0; step < 300; ++step) {
    Raster<float> gradient;
    edge_smoothness(c.depth, c.photograph, c.measured, kSize * kSize, gradient);
    const float rate = 1e-3f * (1 - float(step) / 300);
    for (size_t i = 0; i < c.depth.data.size(); ++i) c.depth.data[i] -= rate * gradient.data[i];
  }
  EXPECT_LT(roughness(0, kSize / 2 - 1), 0.3 * before);
  EXPECT_NEAR(roughness(kSize / 2 - 1, kSize / 2), std::log(1.5), 0.02);
}

TEST(EdgeSmoothness, LeavesMeasuredDepthAlone) {
  Completed c = completed(9, 7, 1);
  c.measured = DepthMap(9, 7, 1);
  Raster<float> gradient;
  EXPECT_EQ(edge_smoothness(c.depth, c.photograph, c.measured, 1, gradient), 0);
  EXPECT_EQ(gradient.data, std::vector<float>(63, 0));
}

TEST(EdgeSmoothness, OfWeightZeroTouchesNothing) {
  const Completed c = completed(9, 7, 1);
  Raster<float> gradient;
  EXPECT_EQ(edge_smoothness(c.depth, c.photograph, c.measured, 0, gradient), 0);
  EXPECT_TRUE(gradient.empty());
}

TEST(EdgeSmoothness, IsTheSameForAnyNumberOfThreads) {
  const Completed c = completed(61, 97, 1);
  Raster<float> first;
  const double expected = edge_smoothness(c.depth, c.photograph, c.measured, 1, first);
  test::for_thread_counts([&] {
    Raster<float> gradient;
    EXPECT_EQ(edge_smoothness(c.depth, c.photograph, c.measured, 1, gradient), expected);
    for (size_t i = 0; i < gradient.data.size(); ++i) EXPECT_EQ(gradient.data[i], first.data[i]);
  });
}

TEST(EdgeSmoothness, RefusesUnequalSizes) {
  Completed c = completed(9, 7, 1);
  c.measured = DepthMap(7, 9, 1);
  Raster<float> gradient;
  EXPECT_THROW(edge_smoothness(c.depth, c.photograph, c.measured, 1, gradient), InvalidInput);
}

}  // namespace
}  // namespace cgs::edge_smoothness_test
