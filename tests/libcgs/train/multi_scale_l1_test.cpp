// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"

namespace cgs::multi_scale_l1_test {
namespace {

using test::doubled;
using test::noise_mask;
using test::noise_planes;

// 2x2 means of one image, as published: the loss is made of two of these pyramids.
Raster<double> pooled(const Raster<double>& fine) {
  Raster<double> out(fine.width / 2, fine.height / 2, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      for (int k = 0; k < 4; ++k) out(x, y) += fine(2 * x + k % 2, 2 * y + k / 2) / 4;
    }
  }
  return out;
}

// What one plane adds to the loss, before the weight.
double reference(Raster<double> a, Raster<double> b, const MaskMap* use, int levels) {
  for (size_t i = 0; i < a.data.size(); ++i) {
    if (use != nullptr && use->data[i] == 0) a.data[i] = b.data[i];
  }
  const std::vector<double> weights = {1, 1.0 / 4, 1.0 / 8, 1.0 / 16, 1.0 / 32};
  double sum = 0;
  for (int l = 0; l < levels && !a.empty(); ++l) {
    double of_level = 0;
    for (size_t i = 0; i < a.data.size(); ++i) of_level += std::abs(a.data[i] - b.data[i]);
    sum += weights[l] * of_level / (3 * double(a.data.size()));
    a = pooled(a);
    b = pooled(b);
  }
  return sum;
}

TEST(MultiScaleL1, EqualsItsDefinition) {
  for (const auto& [width, height] : {std::pair{504, 378}, {33, 17}, {2, 9}, {1, 1}}) {
    const ColorPlanes a = noise_planes(width, height, 1);
    const ColorPlanes b = noise_planes(width, height, 2);
    const MaskMap mask = noise_mask(width, height, 3);
    for (int levels = 1; levels <= 5; ++levels) {
      for (const MaskMap* use : {static_cast<const MaskMap*>(nullptr), &mask}) {
        double expected = 0;
        for (size_t c = 0; c < 3; ++c) {
          expected += 0.8 * reference(doubled(a[c]), doubled(b[c]), use, levels);
        }
        ColorPlanes gradient;
        EXPECT_NEAR(multi_scale_l1(a, b, use, levels, 0.8, gradient), expected, 1e-6 * expected);
      }
    }
  }
}

TEST(MultiScaleL1, OfAConstantDifferenceIsTheSumOfItsWeights) {
  ColorPlanes a;
  ColorPlanes b;
  for (size_t c = 0; c < 3; ++c) {
    a[c] = Raster<float>(504, 378, 0.75f);
    b[c] = Raster<float>(504, 378, 0.25f);
  }
  ColorPlanes gradient;
  EXPECT_NEAR(multi_scale_l1(a, b, nullptr, 5, 1, gradient), 0.5 * 1.46875, 1e-12);
}

TEST(MultiScaleL1, HasTheDerivativeOfItsDefinition) {
  for (const auto& [width, height] : {std::pair{23, 18}, {2, 9}, {1, 1}}) {
    const ColorPlanes a = noise_planes(width, height, 4);
    const ColorPlanes b = noise_planes(width, height, 5);
    const MaskMap mask = noise_mask(width, height, 6);
    for (const MaskMap* use : {static_cast<const MaskMap*>(nullptr), &mask}) {
      ColorPlanes gradient;
      multi_scale_l1(a, b, use, 4, 7, gradient);
      const Raster<double> photograph = doubled(b[2]);
      test::expect_gradient(gradient[2], doubled(a[2]), [&](const Raster<double>& moved) {
        return 7 * reference(moved, photograph, use, 4);
      });
    }
  }
}

TEST(MultiScaleL1, OfEqualImagesOrAnEmptyMaskIsZeroToTheLastBit) {
  const ColorPlanes a = noise_planes(20, 13, 1);
  const MaskMap none(20, 13, 0);
  ColorPlanes gradient;
  EXPECT_EQ(multi_scale_l1(a, a, nullptr, 5, 1, gradient), 0);
  EXPECT_EQ(multi_scale_l1(noise_planes(20, 13, 2), a, &none, 5, 1, gradient), 0);
  for (const Raster<float>& plane : gradient) {
    EXPECT_EQ(plane.data, std::vector<float>(size_t(20 * 13), 0));
  }
}

TEST(MultiScaleL1, AddsToTheGradient) {
  const ColorPlanes a = noise_planes(20, 13, 1);
  const ColorPlanes b = noise_planes(20, 13, 2);
  ColorPlanes once;
  multi_scale_l1(a, b, nullptr, 3, 1, once);
  ColorPlanes twice = once;
  multi_scale_l1(a, b, nullptr, 3, 1, twice);
  for (size_t i = 0; i < once[1].data.size(); ++i) {
    EXPECT_EQ(twice[1].data[i], 2 * once[1].data[i]);
  }
}

TEST(MultiScaleL1, OfWeightZeroTouchesNothing) {
  ColorPlanes gradient;
  EXPECT_EQ(multi_scale_l1(noise_planes(5, 4, 1), noise_planes(5, 4, 2), nullptr, 5, 0, gradient),
            0);
  EXPECT_TRUE(gradient[0].empty());
}

TEST(MultiScaleL1, IsTheSameForAnyNumberOfThreads) {
  const ColorPlanes a = noise_planes(101, 197, 1);
  const ColorPlanes b = noise_planes(101, 197, 2);
  ColorPlanes expected;
  const double value = multi_scale_l1(a, b, nullptr, 5, 0.8, expected);
  test::for_thread_counts([&] {
    ColorPlanes gradient;
    EXPECT_EQ(multi_scale_l1(a, b, nullptr, 5, 0.8, gradient), value);
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(gradient[c].data, expected[c].data);
  });
}

TEST(MultiScaleL1, RefusesUnequalSizesAndNoLevel) {
  ColorPlanes gradient;
  const ColorPlanes a = noise_planes(5, 4, 1);
  const MaskMap wrong(4, 5, 1);
  EXPECT_THROW(multi_scale_l1(a, noise_planes(4, 5, 1), nullptr, 5, 1, gradient), InvalidInput);
  EXPECT_THROW(multi_scale_l1(a, a, &wrong, 5, 1, gradient), InvalidInput);
  EXPECT_THROW(multi_scale_l1({}, {}, nullptr, 5, 1, gradient), InvalidInput);
  EXPECT_THROW(multi_scale_l1(a, a, nullptr, 0, 1, gradient), InvalidInput);
  gradient = noise_planes(4, 5, 1);
  EXPECT_THROW(multi_scale_l1(a, a, nullptr, 5, 1, gradient), InvalidInput);
}

}  // namespace
}  // namespace cgs::multi_scale_l1_test
