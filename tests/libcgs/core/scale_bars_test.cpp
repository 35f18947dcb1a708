// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/scale_bars.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::scale_bars_test {
namespace {

TEST(ScaleBars, OneBarGivesItsRatioAndTheSigmaOfBothSides) {
  const BarScale scale = scale_of({{4, 0.04, 2, 0.06}});
  EXPECT_DOUBLE_EQ(scale.metres_per_unit, 0.5);
  EXPECT_NEAR(scale.sigma / scale.metres_per_unit, std::hypot(0.01, 0.03), 1e-12);
  EXPECT_NEAR(scale.residuals[0], 0, 1e-15);
}

TEST(ScaleBars, SeveralAreWeightedByTheirSigma) {
  // Ratios 1.00 +- 0.01 and 1.02 +- 0.02: weights 4 to 1.
  const BarScale scale = scale_of({{1, 0.01, 1, 0}, {1, 0.02 / 1.02, 1.02, 0}});
  EXPECT_NEAR(scale.metres_per_unit, 1.004, 1e-9);
  EXPECT_NEAR(scale.sigma, 1 / std::sqrt(12500.), 1e-9);
  EXPECT_NEAR(scale.residuals[1], -0.016, 1e-9);
  EXPECT_TRUE(scale.is_consistent);
}

TEST(ScaleBars, NamesTheOneOfThreeThatIsWrong) {
  const BarScale scale = scale_of({{1, 0.01, 1, 0}, {2, 0.02, 2.5, 0}, {3, 0.03, 3.01, 0}});
  EXPECT_EQ(scale.used, (std::vector<bool>{true, false, true}));
  EXPECT_NEAR(scale.metres_per_unit, 1.0017, 5e-4);
  EXPECT_NEAR(scale.residuals[1], -0.5, 0.01);
  EXPECT_TRUE(scale.is_consistent);
}

TEST(ScaleBars, TwoThatDisagreeAreBothKeptAndWidenTheSigma) {
  const BarScale scale = scale_of({{1, 0.01, 1, 0}, {1, 0.01, 1.2, 0}});
  EXPECT_EQ(scale.used, (std::vector<bool>{true, true}));
  EXPECT_FALSE(scale.is_consistent);
  EXPECT_GT(scale.sigma, 0.09);  // each is 0.1 from the middle
}

TEST(ScaleBars, KeepAPreciseOneThatRoughOnesAgreeWith) {
  const BarScale scale = scale_of({{1, 0, 1, 0.001}, {1, 0, 1.05, 0.05}, {1, 0, 1.06, 0.05}});
  EXPECT_EQ(scale.used, (std::vector<bool>{true, true, true}));
  EXPECT_NEAR(scale.metres_per_unit, 1, 0.001);
}

TEST(ScaleBars, ThreeThatAllDisagreeAreKeptAndWidenTheSigma) {
  const BarScale scale = scale_of({{1, 0, 1.00, 0.001}, {1, 0, 1.01, 0.001}, {1, 0, 1.02, 0.001}});
  EXPECT_EQ(scale.used, (std::vector<bool>{true, true, true}));
  EXPECT_FALSE(scale.is_consistent);
  EXPECT_GT(scale.sigma, 0.005);
}

TEST(ScaleBars, SigmaIsThatOfManyDraws) {
  std::mt19937 random(3);
  std::normal_distribution<> normal;
  double squares = 0;
  double claimed = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    std::vector<ScaleBar> bars;
    for (const double length : {1., 2., 5., 5.}) {
      bars.push_back({length + 0.02 * normal(random), 0.02, length * 3, 0});
    }
    const BarScale scale = scale_of(bars);
    squares += (scale.metres_per_unit - 3) * (scale.metres_per_unit - 3);
    claimed += scale.sigma * scale.sigma;
  }
  // The Birge ratio widens some, and leaving good bars out by chance takes a little.
  EXPECT_GT(claimed / squares, 0.9);
  EXPECT_LT(claimed / squares, 1.5);
}

TEST(ScaleBars, RefusesLengthsThatNoneCanHave) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(scale_of({}), InvalidInput);
  for (const ScaleBar& bar : {ScaleBar{0, 0, 1, 0},
                              ScaleBar{1, 0, 0, 0},
                              ScaleBar{1, -1, 1, 0},
                              ScaleBar{1, 0, 1, nan},
                              ScaleBar{nan, 0, 1, 0}}) {
    EXPECT_THROW(scale_of({bar}), InvalidInput);
  }
  EXPECT_DOUBLE_EQ(scale_of({{1e-12, 0, 1e12, 0}}).metres_per_unit, 1e24);
}

}  // namespace
}  // namespace cgs::scale_bars_test
