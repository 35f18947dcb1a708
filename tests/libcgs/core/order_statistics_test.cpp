// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/order_statistics.h"

#include <gtest/gtest.h>

namespace cgs::order_statistics_test {
namespace {

TEST(OrderStatistics, MedianOfAnEvenNumberIsTheSmallerOneOfTheTwo) {
  EXPECT_EQ(median_of({3, 1, 2, 10}), 2);
  EXPECT_EQ(median_of({3, 1, 2}), 2);
}

}  // namespace
}  // namespace cgs::order_statistics_test
