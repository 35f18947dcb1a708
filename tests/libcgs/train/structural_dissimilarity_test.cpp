// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/image_metrics.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"

namespace cgs::structural_dissimilarity_test {
namespace {

using test::doubled;
using test::noise_mask;
using test::noise_planes;

ColorImage interleaved(const ColorPlanes& planes) {
  ColorImage out(planes[0].width, planes[0].height, Eigen::Vector3f::Zero());
  for (size_t i = 0; i < out.data.size(); ++i) {
    out.data[i] = {planes[0].data[i], planes[1].data[i], planes[2].data[i]};
  }
  return out;
}

ColorPlanes masked(const ColorPlanes& rendered, const ColorPlanes& photograph, const MaskMap& use) {
  ColorPlanes out = rendered;
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < use.data.size(); ++i) {
      if (use.data[i] == 0) out[c].data[i] = photograph[c].data[i];
    }
  }
  return out;
}

// Neither equal nor unrelated.
ColorPlanes near(const ColorPlanes& photograph, float distance) {
  ColorPlanes out = noise_planes(photograph[0].width, photograph[0].height, 77);
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < out[c].data.size(); ++i) {
      const float target = photograph[c].data[i];
      out[c].data[i] = target + distance * (out[c].data[i] - target);
    }
  }
  return out;
}

// Sum of 1 - SSIM over one plane, from the definition with 121 weights and centred moments.
double reference(const Raster<double>& a, const Raster<double>& b, const MaskMap* use) {
  std::vector<double> weight;
  double total = 0;
  for (int k = 0; k < 121; ++k) {
    const int i = k % 11 - 5;
    const int j = k / 11 - 5;
    weight.push_back(std::exp(-(i * i + j * j) / 4.5));
    total += weight.back();
  }
  double sum = 0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const auto mean = [&](const auto& value) {
        double out = 0;
        for (int k = 0; k < 121; ++k) {
          const int u = x + k % 11 - 5;
          const int v = y + k / 11 - 5;
          const bool inside = a.contains(u, v);
          const double q = inside ? b(u, v) : 0;
          const double p = inside && (use == nullptr || (*use)(u, v) != 0) ? a(u, v) : q;
          out += weight[k] / total * value(p, q);
        }
        return out;
      };
      const double ma = mean([](double p, double) { return p; });
      const double mb = mean([](double, double q) { return q; });
      const double va = mean([&](double p, double) { return (p - ma) * (p - ma); });
      const double vb = mean([&](double, double q) { return (q - mb) * (q - mb); });
      const double cov = mean([&](double p, double q) { return (p - ma) * (q - mb); });
      sum += 1 - (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) /
                     ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
    }
  }
  return sum;
}

TEST(StructuralDissimilarity, IsOneMinusSsim) {
  for (const auto& [width, height] : {std::pair{64, 41}, {4, 30}, {1, 1}}) {
    const ColorPlanes photograph = noise_planes(width, height, 1);
    for (const float distance : {1.0f, 0.3f, 0.01f}) {
      const ColorPlanes rendered = near(photograph, distance);
      ColorPlanes gradient;
      const double expected = 1 - ssim(interleaved(rendered), interleaved(photograph));
      const double value = structural_dissimilarity(rendered, photograph, nullptr, 2, gradient);
      EXPECT_NEAR(value, 2 * expected, 1e-5 * expected + 1e-9) << width << " " << distance;
    }
  }
}

TEST(StructuralDissimilarity, OfFlatBrightImagesIsAsGoodAsInDouble) {
  const ColorPlanes white = [] {
    const Raster<float> plane(40, 30, 1);
    return ColorPlanes{plane, plane, plane};
  }();
  ColorPlanes nearly = white;
  for (Raster<float>& plane : nearly) {
    for (size_t i = 0; i < plane.data.size(); ++i) plane.data[i] -= i % 2 == 0 ? 1e-3f : 0;
  }
  ColorPlanes gradient;
  const double expected = 1 - ssim(interleaved(nearly), interleaved(white));
  EXPECT_LT(expected, 1e-3);
  const double value = structural_dissimilarity(nearly, white, nullptr, 1, gradient);
  EXPECT_NEAR(value, expected, 1e-3 * expected);
}

TEST(StructuralDissimilarity, HasTheDerivativeOfTheDefinition) {
  for (const auto& [width, height] : {std::pair{13, 9}, {3, 14}, {1, 1}}) {
    const ColorPlanes photograph = noise_planes(width, height, 2);
    const MaskMap mask = noise_mask(width, height, 3);
    const double values = 3.0 * width * height;
    for (const float distance : {1.0f, 0.05f}) {
      for (const MaskMap* use : {static_cast<const MaskMap*>(nullptr), &mask}) {
        const ColorPlanes rendered = near(photograph, distance);
        ColorPlanes gradient;
        structural_dissimilarity(rendered, photograph, use, 5, gradient);
        const Raster<double> b = doubled(photograph[1]);
        test::expect_gradient(gradient[1], doubled(rendered[1]), [&](const Raster<double>& moved) {
          return 5 * reference(moved, b, use) / values;
        });
      }
    }
  }
}

TEST(StructuralDissimilarity, ReplacesUnusedPixelsByThePhotograph) {
  const ColorPlanes photograph = noise_planes(37, 23, 4);
  const ColorPlanes rendered = noise_planes(37, 23, 5);
  const MaskMap use = noise_mask(37, 23, 6);
  ColorPlanes gradient;
  ColorPlanes of_replaced;
  const double value = structural_dissimilarity(rendered, photograph, &use, 1, gradient);
  EXPECT_EQ(value,
            structural_dissimilarity(
                masked(rendered, photograph, use), photograph, nullptr, 1, of_replaced));
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < use.data.size(); ++i) {
      EXPECT_EQ(gradient[c].data[i], use.data[i] == 0 ? 0 : of_replaced[c].data[i]);
    }
  }
}

TEST(StructuralDissimilarity, OfEqualImagesOrAnEmptyMaskIsZeroToTheLastBit) {
  const ColorPlanes a = noise_planes(20, 13, 1);
  const MaskMap none(20, 13, 0);
  ColorPlanes gradient;
  EXPECT_EQ(structural_dissimilarity(a, a, nullptr, 1, gradient), 0);
  EXPECT_EQ(structural_dissimilarity(noise_planes(20, 13, 2), a, &none, 1, gradient), 0);
  for (const Raster<float>& plane : gradient) {
    EXPECT_EQ(plane.data, std::vector<float>(size_t(20 * 13), 0));
  }
}

TEST(StructuralDissimilarity, OfConstantImagesIsZeroWithoutAGradient) {
  for (const float value : {0.0f, 0.3f, 1.0f}) {
    ColorPlanes image;
    image.fill(Raster<float>(40, 30, value));
    ColorPlanes gradient;
    EXPECT_NEAR(structural_dissimilarity(image, image, nullptr, 1, gradient), 0, 1e-6) << value;
    for (const Raster<float>& plane : gradient) {
      EXPECT_EQ(plane.data, std::vector<float>(size_t(40 * 30), 0)) << value;
    }
  }
}

TEST(StructuralDissimilarity, AddsToTheGradient) {
  const ColorPlanes a = noise_planes(20, 13, 1);
  const ColorPlanes b = noise_planes(20, 13, 2);
  ColorPlanes once;
  structural_dissimilarity(a, b, nullptr, 1, once);
  ColorPlanes twice = once;
  structural_dissimilarity(a, b, nullptr, 1, twice);
  for (size_t i = 0; i < once[2].data.size(); ++i) {
    EXPECT_EQ(twice[2].data[i], 2 * once[2].data[i]);
  }
}

TEST(StructuralDissimilarity, OfWeightZeroTouchesNothing) {
  ColorPlanes gradient;
  EXPECT_EQ(
      structural_dissimilarity(noise_planes(5, 4, 1), noise_planes(5, 4, 2), nullptr, 0, gradient),
      0);
  EXPECT_TRUE(gradient[0].empty());
}

TEST(StructuralDissimilarity, IsTheSameForAnyNumberOfThreads) {
  const ColorPlanes a = noise_planes(101, 97, 1);
  const ColorPlanes b = noise_planes(101, 97, 2);
  ColorPlanes expected;
  const double value = structural_dissimilarity(a, b, nullptr, 0.2, expected);
  test::for_thread_counts([&] {
    ColorPlanes gradient;
    EXPECT_EQ(structural_dissimilarity(a, b, nullptr, 0.2, gradient), value);
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(gradient[c].data, expected[c].data);
  });
}

TEST(StructuralDissimilarity, RefusesUnequalSizes) {
  ColorPlanes gradient;
  const ColorPlanes a = noise_planes(5, 4, 1);
  const MaskMap wrong(4, 5, 1);
  EXPECT_THROW(structural_dissimilarity(a, noise_planes(4, 5, 1), nullptr, 1, gradient),
               InvalidInput);
  EXPECT_THROW(structural_dissimilarity(a, a, &wrong, 1, gradient), InvalidInput);
  EXPECT_THROW(structural_dissimilarity({}, {}, nullptr, 1, gradient), InvalidInput);
  gradient = noise_planes(4, 5, 1);
  EXPECT_THROW(structural_dissimilarity(a, a, nullptr, 1, gradient), InvalidInput);
}

}  // namespace
}  // namespace cgs::structural_dissimilarity_test
