// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/learning_rate.h"

#include <gtest/gtest.h>

namespace cgs::learning_rate_test {
namespace {

TEST(Triangular2, StartsAtTheBaseAndPeaksAfterHalfAPeriod) {
  EXPECT_DOUBLE_EQ(triangular2(0, 1e-6, 1e-4, 1000), 1e-6);
  EXPECT_DOUBLE_EQ(triangular2(1000, 1e-6, 1e-4, 1000), 1e-4);
  EXPECT_DOUBLE_EQ(triangular2(2000, 1e-6, 1e-4, 1000), 1e-6);
}

TEST(Triangular2, HalvesItsHeightWithEachCycle) {
  EXPECT_DOUBLE_EQ(triangular2(3000, 1e-6, 1e-4, 1000), 5.05e-5);
  EXPECT_DOUBLE_EQ(triangular2(5000, 1e-6, 1e-4, 1000), 1e-6 + 9.9e-5 / 4);
}

TEST(Triangular2, IsLinearBetween) {
  EXPECT_DOUBLE_EQ(triangular2(250, 0, 1, 1000), 0.25);
  EXPECT_DOUBLE_EQ(triangular2(1750, 0, 1, 1000), 0.25);
  EXPECT_DOUBLE_EQ(triangular2(2500, 0, 1, 1000), 0.25);
}

}  // namespace
}  // namespace cgs::learning_rate_test
