// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/noise.h"

#include <gtest/gtest.h>

namespace cgs::noise_test {
namespace {

using Eigen::Vector3f;

TEST(GradientNoise, IsZeroOnTheLatticeAndContinuousAcrossIt) {
  for (const int i : {-3, 0, 4}) {
    const Vector3f p(static_cast<float>(i), 2, -1);
    EXPECT_EQ(gradient_noise(p, 5), 0);
    EXPECT_NEAR(gradient_noise(p + Vector3f(-1e-4F, 0.3F, 0.6F), 5),
                gradient_noise(p + Vector3f(1e-4F, 0.3F, 0.6F), 5),
                1e-3F);
  }
}

TEST(GradientNoise, HasZeroMeanAndDoesNotRepeat) {
  double sum = 0;
  double squares = 0;
  double shifted = 0;
  constexpr int kCount = 40000;
  for (int i = 0; i < kCount; ++i) {
    const Vector3f p(
        0.137F * static_cast<float>(i % 200), 0.211F * static_cast<float>(i / 200), 0.5F);
    const auto here = static_cast<double>(gradient_noise(p, 1));
    sum += here;
    squares += here * here;
    shifted += here * static_cast<double>(gradient_noise(p + Vector3f(64, 0, 0), 1));
  }
  EXPECT_NEAR(sum / kCount, 0, 0.02);
  EXPECT_GT(squares / kCount, 0.03);
  EXPECT_LT(std::abs(shifted), 0.1 * squares);
}

TEST(BandNoise, LeavesOutWhatAFootprintCannotResolve) {
  const Vector3f p(0.31F, 0.52F, 0.93F);
  const NoiseBand band{.longest = 0.8F, .shortest = 0.1F, .gain = 1};
  const NoiseBand coarse{.longest = 0.8F, .shortest = 0.4F, .gain = 1};
  EXPECT_EQ(band_noise(p, band, 0.2F, 3), band_noise(p, coarse, 0.01F, 3));
  EXPECT_NE(band_noise(p, band, 0.01F, 3), band_noise(p, coarse, 0.01F, 3));
  EXPECT_EQ(band_noise(p, band, 1.0F, 3), 0);
}

}  // namespace
}  // namespace cgs::noise_test
