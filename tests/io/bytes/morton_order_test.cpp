// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/morton_order.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace cgs::morton_order_test {
namespace {

TEST(MortonOrder, FollowsTheZCurveOfAGrid) {
  std::vector<Eigen::Vector3f> grid;
  for (int i = 0; i < 64; ++i) {  // from the far end to the near one, z fastest
    grid.emplace_back(3 - i / 16, 3 - i / 4 % 4, 3 - i % 4);
  }
  const std::vector<uint32_t> order = morton_order(grid);
  for (size_t place = 0; place < 64; ++place) {
    Eigen::Vector3f expected = Eigen::Vector3f::Zero();
    for (size_t bit = 0; bit < 6; ++bit) {  // x lowest, then y, z, and again
      expected[static_cast<int>(bit % 3)] += static_cast<float>((place >> bit & 1U) << bit / 3);
    }
    EXPECT_EQ(grid[order[place]], expected) << place;
  }
}

TEST(MortonOrder, KeepsTheOrderOfPointsInOnePlace) {
  const std::vector<Eigen::Vector3f> one(5, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(morton_order(one), (std::vector<uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_TRUE(morton_order({}).empty());
}

}  // namespace
}  // namespace cgs::morton_order_test
