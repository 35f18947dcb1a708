// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/order_statistics.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::order_statistics_test {
namespace {

TEST(OrderStatistics, MedianOfAnEvenNumberIsTheSmallerOneOfTheTwo) {
  EXPECT_EQ(median_of({3, 1, 2, 10}), 2);
  EXPECT_EQ(median_of({3, 1, 2}), 2);
}

TEST(OrderStatistics, QuantilesAreTheSameOfSortedValuesAsOfAny) {
  std::vector<double> values;
  for (int i = 0; i < 100; ++i) values.push_back(i * 37 % 101);
  std::vector<double> ascending = values;
  std::sort(ascending.begin(), ascending.end());
  for (const double q : {0.0, 0.05, 0.5, 0.95, 1.0}) {
    EXPECT_EQ(quantile_of_sorted(ascending, q), quantile(values, q)) << q;
  }
}

TEST(OrderStatistics, RobustDeviationIsThatOfANormalDistribution) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(5, 2);
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) values.push_back(i % 10 == 0 ? 1e6 : normal(random));
  EXPECT_NEAR(robust_deviation(values), 2, 0.3);
  EXPECT_EQ(robust_deviation({}), 0);
}

}  // namespace
}  // namespace cgs::order_statistics_test
