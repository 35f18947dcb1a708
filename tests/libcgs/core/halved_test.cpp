// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/halved.h"

#include <gtest/gtest.h>

namespace cgs::halved_test {
namespace {

TEST(Halved, HasTheMeansOfFourAndLeavesOutOddRowsAndColumns) {
  Raster<float> in(5, 3, 100);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 4; ++x) in(x, y) = static_cast<float>(x * x + 8 * y);
  }
  const Raster<float> out = halved(in);
  ASSERT_EQ(out.width, 2);
  ASSERT_EQ(out.height, 1);
  EXPECT_EQ(out(0, 0), 4.5f);   // of 0, 1, 8, 9
  EXPECT_EQ(out(1, 0), 10.5f);  // of 4, 9, 12, 17
}

TEST(Halved, TakesColoursAndWhatIsTooSmall) {
  ColorImage in(2, 2, Eigen::Vector3f(1, 2, 3));
  in(1, 1) = Eigen::Vector3f(5, 2, -1);
  EXPECT_EQ(halved(in)(0, 0), Eigen::Vector3f(2, 2, 2));
  EXPECT_TRUE(halved(Raster<float>(7, 1, 1)).empty());
  EXPECT_TRUE(halved(Raster<float>()).empty());
}

}  // namespace
}  // namespace cgs::halved_test
