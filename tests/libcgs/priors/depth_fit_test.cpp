// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_fit.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace cgs::depth_fit_test {
namespace {

// y = scale x + offset with relative noise; of every hundred points `wild` are anything.
std::vector<FitPoint> planted(double scale, double offset, double noise, int wild) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0.5, 3);
  std::normal_distribution<double> normal;
  std::vector<FitPoint> out;
  for (int i = 0; i < 4000; ++i) {
    const double x = place(random);
    const double y = (scale * x + offset) * std::exp(noise * normal(random));
    out.push_back({x, i % 100 < wild ? place(random) : y, 0.001});
  }
  return out;
}

TEST(FitLine, FindsThePlantedLineAmongOutliers) {
  for (const int wild : {0, 20, 40}) {
    const auto line = fit_line(planted(0.8, 0.3, 0.01, wild));
    ASSERT_TRUE(line) << wild;
    EXPECT_NEAR(line->scale, 0.8, 0.02 * 0.8) << wild;
    EXPECT_NEAR(line->offset, 0.3, 0.02) << wild;
  }
}

TEST(FitLine, IsExactWithoutNoise) {
  const auto line = fit_line(planted(2, -0.4, 0, 0));
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->scale, 2, 1e-9);
  EXPECT_NEAR(line->offset, -0.4, 1e-9);
}

TEST(FitLine, TellsTheScatter) {
  const auto line = fit_line(planted(0.8, 0.3, 0.03, 0));
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->scatter, 0.03, 0.003);
}

TEST(FitLine, RefusesWhatDoesNotFit) {
  EXPECT_FALSE(fit_line(planted(0.8, 0.3, 0.01, 100)));  // nothing to do with each other
  EXPECT_FALSE(fit_line(planted(-0.3, 2, 0.01, 0)));     // the wrong way round
  EXPECT_FALSE(fit_line(std::vector<FitPoint>(1000, {1, 2, 0.1})));
  std::vector<FitPoint> few = planted(0.8, 0.3, 0.01, 0);
  few.resize(49);
  EXPECT_FALSE(fit_line(few));
  EXPECT_FALSE(fit_scale(few));
  EXPECT_FALSE(fit_line({}));
}

TEST(FitScale, IsTheMedianRatio) {
  const auto scale = fit_scale(planted(0.25, 0, 0.02, 30));
  ASSERT_TRUE(scale);
  EXPECT_NEAR(scale->scale, 0.25, 0.25 * 0.02);
  EXPECT_EQ(scale->offset, 0);
}

}  // namespace
}  // namespace cgs::depth_fit_test
