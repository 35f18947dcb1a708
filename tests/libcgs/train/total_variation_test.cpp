// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"

namespace cgs::total_variation_test {
namespace {

using test::doubled;

constexpr float kUnit = 0.625f;

// Opacities on both sides of the threshold, also 0, and depths that fit them.
TrainingBuffers scene(int width, int height, unsigned seed) {
  TrainingBuffers out;
  out.alpha = test::noise_raster(width, height, seed, 0, 1);
  out.depth_sum = test::noise_raster(width, height, seed + 1, 0.5f, 1);
  for (size_t i = 0; i < out.alpha.data.size(); ++i) {
    if (i % 7 == 3) out.alpha.data[i] = 0;
    if (i % 7 == 5) out.alpha.data[i] = 0.04f;
    out.depth_sum.data[i] *= out.alpha.data[i];
  }
  return out;
}

Raster<uint8_t> noise_layers(int width, int height) {
  Raster<uint8_t> out(width, height, 0);
  std::mt19937 random(9);
  for (uint8_t& layer : out.data) layer = static_cast<uint8_t>(random() % 2);
  return out;
}

// In the words of the header, with the quotient D / A of the published form.
double reference(const Raster<double>& alpha,
                 const Raster<double>& depth_sum,
                 const Raster<uint8_t>* layer) {
  const auto disparity = [&](int x, int y) {
    return 1 / (1 + depth_sum(x, y) / (alpha(x, y) + 1e-6) / double(kUnit));
  };
  double total = 0;
  for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
    double sum = 0;
    double count = 0;
    for (int y = 0; y + dy < alpha.height; ++y) {
      for (int x = 0; x + dx < alpha.width; ++x) {
        if (alpha(x, y) < 0.05 || alpha(x + dx, y + dy) < 0.05) continue;
        if (layer != nullptr && (*layer)(x, y) != (*layer)(x + dx, y + dy)) continue;
        sum += std::abs(disparity(x, y) - disparity(x + dx, y + dy));
        ++count;
      }
    }
    if (count > 0) total += sum / count;
  }
  return total;
}

TEST(TotalVariation, EqualsItsDefinition) {
  for (const auto& [width, height] : {std::pair{40, 31}, {1, 9}, {9, 1}, {1, 1}}) {
    const TrainingBuffers rendered = scene(width, height, 1);
    const Raster<uint8_t> layer = noise_layers(width, height);
    for (const Raster<uint8_t>* layers : {static_cast<const Raster<uint8_t>*>(nullptr), &layer}) {
      TrainingBuffers gradient;
      const double expected =
          5 * reference(doubled(rendered.alpha), doubled(rendered.depth_sum), layers);
      EXPECT_NEAR(total_variation(rendered, kUnit, layers, 5, gradient), expected, 1e-9);
    }
  }
}

TEST(TotalVariation, HasTheDerivativesOfItsDefinition) {
  const TrainingBuffers rendered = scene(19, 14, 3);
  const Raster<uint8_t> layer = noise_layers(19, 14);
  const Raster<double> alpha = doubled(rendered.alpha);
  const Raster<double> depth_sum = doubled(rendered.depth_sum);
  for (const Raster<uint8_t>* layers : {static_cast<const Raster<uint8_t>*>(nullptr), &layer}) {
    TrainingBuffers gradient;
    total_variation(rendered, kUnit, layers, 5, gradient);
    test::expect_gradient(gradient.alpha, alpha, [&](const Raster<double>& moved) {
      return 5 * reference(moved, depth_sum, layers);
    });
    test::expect_gradient(gradient.depth_sum, depth_sum, [&](const Raster<double>& moved) {
      return 5 * reference(alpha, moved, layers);
    });
    EXPECT_TRUE(gradient.color[0].empty());
    EXPECT_TRUE(gradient.depth_square_sum.empty());
  }
}

TEST(TotalVariation, OfAStepBetweenLayersCountsOnlyWithoutLayers) {
  TrainingBuffers rendered;
  rendered.alpha = Raster<float>(8, 6, 1);
  rendered.depth_sum = Raster<float>(8, 6, 1);
  Raster<uint8_t> layer(8, 6, 0);
  for (int y = 0; y < 6; ++y) {
    for (int x = 4; x < 8; ++x) {
      rendered.depth_sum(x, y) = 3;
      layer(x, y) = 1;
    }
  }
  TrainingBuffers gradient;
  // One of seven pairs along x steps from 1 / (1 + 1) to 1 / (1 + 3).
  EXPECT_NEAR(total_variation(rendered, 1, nullptr, 1, gradient), 0.25 / 7, 1e-6);
  gradient = {};
  EXPECT_EQ(total_variation(rendered, 1, &layer, 1, gradient), 0);
  EXPECT_EQ(gradient.depth_sum.data, std::vector<float>(48, 0));
}

TEST(TotalVariation, IgnoresPixelsThatAreNearlyTransparent) {
  TrainingBuffers rendered;
  rendered.alpha = Raster<float>(8, 6, 0.049f);
  rendered.depth_sum = test::noise_raster(8, 6, 1, 0, 1);
  TrainingBuffers gradient;
  EXPECT_EQ(total_variation(rendered, 1, nullptr, 1, gradient), 0);
  EXPECT_EQ(gradient.alpha.data, std::vector<float>(48, 0));
  EXPECT_EQ(gradient.depth_sum.data, std::vector<float>(48, 0));
}

TEST(TotalVariation, StaysFiniteForAnyOpacity) {
  for (const float alpha : {0.0f, 1e-38f, 1e-6f, 1e-3f, 0.05f, 1.0f}) {
    for (const float depth : {0.0f, 1e-6f, 1.0f, 1e6f}) {
      TrainingBuffers rendered;
      rendered.alpha = test::noise_raster(8, 6, 1, 0, alpha);
      rendered.alpha(3, 3) = alpha;
      rendered.depth_sum = Raster<float>(8, 6, 0);
      for (size_t i = 0; i < 48; ++i) rendered.depth_sum.data[i] = depth * rendered.alpha.data[i];
      TrainingBuffers gradient;
      EXPECT_TRUE(std::isfinite(total_variation(rendered, kUnit, nullptr, 1, gradient)));
      for (size_t i = 0; i < 48; ++i) {
        EXPECT_TRUE(std::isfinite(gradient.alpha.data[i])) << alpha << " at " << depth;
        EXPECT_TRUE(std::isfinite(gradient.depth_sum.data[i])) << alpha << " at " << depth;
        if (rendered.alpha.data[i] >= 1e-3f) continue;
        EXPECT_EQ(gradient.alpha.data[i], 0) << "nothing is learnt from depth that is not there";
        EXPECT_EQ(gradient.depth_sum.data[i], 0);
      }
    }
  }
}

TEST(TotalVariation, AddsToTheGradient) {
  const TrainingBuffers rendered = scene(19, 14, 3);
  TrainingBuffers once;
  total_variation(rendered, 1, nullptr, 1, once);
  TrainingBuffers twice = once;
  total_variation(rendered, 1, nullptr, 1, twice);
  for (size_t i = 0; i < once.alpha.data.size(); ++i) {
    EXPECT_EQ(twice.alpha.data[i], 2 * once.alpha.data[i]);
    EXPECT_EQ(twice.depth_sum.data[i], 2 * once.depth_sum.data[i]);
  }
}

TEST(TotalVariation, OfWeightZeroTouchesNothing) {
  TrainingBuffers gradient;
  EXPECT_EQ(total_variation(scene(5, 4, 1), 1, nullptr, 0, gradient), 0);
  EXPECT_TRUE(gradient.alpha.empty());
  EXPECT_TRUE(gradient.depth_sum.empty());
}

TEST(TotalVariation, IsTheSameForAnyNumberOfThreads) {
  const TrainingBuffers rendered = scene(101, 197, 1);
  TrainingBuffers expected;
  const double value = total_variation(rendered, 1, nullptr, 1, expected);
  test::for_thread_counts([&] {
    TrainingBuffers gradient;
    EXPECT_EQ(total_variation(rendered, 1, nullptr, 1, gradient), value);
    EXPECT_EQ(gradient.alpha.data, expected.alpha.data);
    EXPECT_EQ(gradient.depth_sum.data, expected.depth_sum.data);
  });
}

TEST(TotalVariation, RefusesUnequalSizesAndUnitsThatAreNotPositive) {
  TrainingBuffers rendered = scene(5, 4, 1);
  TrainingBuffers gradient;
  const Raster<uint8_t> wrong(4, 5, 0);
  EXPECT_THROW(total_variation(rendered, 1, &wrong, 1, gradient), InvalidInput);
  EXPECT_THROW(total_variation(rendered, 0, nullptr, 1, gradient), InvalidInput);
  EXPECT_THROW(total_variation(rendered, NAN, nullptr, 1, gradient), InvalidInput);
  EXPECT_THROW(total_variation({}, 1, nullptr, 1, gradient), InvalidInput);
  rendered.depth_sum = Raster<float>(4, 5, 1);
  EXPECT_THROW(total_variation(rendered, 1, nullptr, 1, gradient), InvalidInput);
}

}  // namespace
}  // namespace cgs::total_variation_test
