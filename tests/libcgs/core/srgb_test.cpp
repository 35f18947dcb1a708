// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/srgb.h"

#include <gtest/gtest.h>

namespace cgs::srgb_test {
namespace {

TEST(LinearFromSrgb, AgreesWithTheStandard) {
  EXPECT_EQ(linear_from_srgb(0), 0.0f);
  EXPECT_FLOAT_EQ(linear_from_srgb(1), 1.0f);
  EXPECT_NEAR(linear_from_srgb(0.5f), 0.2140411, 1e-6);
  EXPECT_NEAR(linear_from_srgb(0.04f), 0.04 / 12.92, 1e-8);
  EXPECT_EQ(linear_from_srgb(-0.5f), -linear_from_srgb(0.5f));
  EXPECT_GT(linear_from_srgb(1.5f), 2.0f);
}

TEST(SrgbFromLinear, UndoesLinearFromSrgb) {
  for (int i = -300; i <= 300; ++i) {
    const float coded = static_cast<float>(i) / 255.0f;
    EXPECT_NEAR(srgb_from_linear(linear_from_srgb(coded)), coded, 1e-6);
  }
  EXPECT_NEAR(srgb_from_linear(0.2140411f), 0.5, 1e-6);
}

}  // namespace
}  // namespace cgs::srgb_test
