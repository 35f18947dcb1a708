// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/places.h"

#include <gtest/gtest.h>

namespace cgs::places_test {
namespace {

TEST(FirstAtPlace, IsTheLowestIndexOfEqualPoints) {
  const std::vector<Eigen::Vector3d> points = {
      {1, 2, 3}, {0, 0, 0}, {1, 2, 3}, {0, -0.0, 0}, {1, 2, 3.0000001}, {1, 2, 3}};
  EXPECT_EQ(first_at_place(points), (std::vector<uint32_t>{0, 1, 0, 1, 4, 0}));
  EXPECT_TRUE(first_at_place(std::vector<Eigen::Vector3d>{}).empty());
}

TEST(FirstAtPlace, IsTheSameForFloatsAsForDoubles) {
  std::vector<Eigen::Vector3f> floats;
  std::vector<Eigen::Vector3d> doubles;
  for (int i = 0; i < 5000; ++i) {
    floats.emplace_back(float(i * 7 % 11), float(i * 5 % 13), i % 2 == 0 ? 0.0f : -0.0f);
    doubles.push_back(floats.back().cast<double>());
  }
  std::vector<uint32_t> expected;
  for (uint32_t i = 0; i < 5000; ++i) expected.push_back(i % (11 * 13));
  EXPECT_EQ(first_at_place(floats), expected);
  EXPECT_EQ(first_at_place(doubles), expected);
}

}  // namespace
}  // namespace cgs::places_test
