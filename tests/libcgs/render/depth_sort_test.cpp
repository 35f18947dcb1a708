// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/depth_sort.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace cgs::depth_sort_test {
namespace {

TEST(SortDepthKeys, OrdersByDepthThenIndexAtAnySizeAndSpreadOfDepths) {
  std::mt19937 random(1);
  std::vector<uint64_t> scratch;
  for (const size_t count : {0, 1, 100, 5000, 40'000}) {
    for (const double decades : {0.0, 1e-6, 0.01, 3.0, 60.0}) {
      std::uniform_real_distribution<double> exponent(-decades / 2, decades / 2);
      std::vector<uint64_t> keys;
      for (uint32_t i = 0; i < count; ++i) {
        keys.push_back(depth_key(float(std::pow(10.0, exponent(random))), i));
      }
      std::vector<uint64_t> expected = keys;
      std::sort(expected.begin(), expected.end());
      sort_depth_keys(keys, scratch);
      EXPECT_EQ(keys, expected) << count << " over " << decades << " decades";
    }
  }
}

}  // namespace
}  // namespace cgs::depth_sort_test
