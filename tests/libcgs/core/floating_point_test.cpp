// SPDX-License-Identifier: GPL-3.0-or-later
// The arithmetic everything else rests on: the compiler must neither assume that NaN does not occur
// nor fuse a product and a sum that are written apart.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace cgs::floating_point_test {
namespace {

// Values the compiler cannot know.
template <typename T>
T unknown(T value) {
  volatile T hidden = value;
  return hidden;
}

TEST(FloatingPoint, KnowsNanAndInfinity) {
#ifdef __FAST_MATH__
  FAIL() << "compiled with -ffast-math";
#endif
  const float nan = unknown(std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(std::isnan(nan));
  EXPECT_FALSE(nan == nan);
  EXPECT_FALSE(std::isfinite(unknown(std::numeric_limits<float>::infinity())));
  EXPECT_TRUE(std::isnan(unknown(0.0f) / unknown(0.0f)));
}

TEST(FloatingPoint, KeepsSmallNumbersAndTheOrderOfSums) {
  EXPECT_GT(unknown(1e-40f) * 1.0f, 0);
  const float large = unknown(1e8f);
  EXPECT_EQ((large + 1.0f) - large, 0);
}

TEST(FloatingPoint, RoundsProductsBeforeItAddsThem) {
  // (1 + e)^2 - (1 + 2 e) is e^2 where the product is not rounded.
  const float a = 1 + unknown(std::numeric_limits<float>::epsilon());
  const float b = 1 + 2 * unknown(std::numeric_limits<float>::epsilon());
  EXPECT_EQ(a * a - b, 0);
  const double c = 1 + unknown(std::numeric_limits<double>::epsilon());
  const double d = 1 + 2 * unknown(std::numeric_limits<double>::epsilon());
  EXPECT_EQ(c * c - d, 0);
}

}  // namespace
}  // namespace cgs::floating_point_test
