// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace cgs::pareto_test {
namespace {

// The definition, word by word.
std::vector<size_t> front_by_trying_all(const std::vector<CostAndLoss>& points) {
  std::vector<size_t> out;
  for (size_t i = 0; i < points.size(); ++i) {
    const CostAndLoss& p = points[i];
    bool beaten = !std::isfinite(p.cost) || !std::isfinite(p.loss);
    for (size_t j = 0; j < points.size(); ++j) {
      const CostAndLoss& q = points[j];
      const bool equal = q.cost == p.cost && q.loss == p.loss;
      if (q.cost <= p.cost && q.loss <= p.loss && (!equal || j < i)) {
        beaten = beaten || (std::isfinite(q.cost) && std::isfinite(q.loss));
      }
    }
    if (!beaten) out.push_back(i);
  }
  std::sort(
      out.begin(), out.end(), [&](size_t a, size_t b) { return points[a].cost < points[b].cost; });
  return out;
}

TEST(ParetoFront, EqualsTryingAllPairs) {
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    // Few different values, so that many are equal in one or both.
    std::uniform_int_distribution<int> value(-3, round % 12);
    std::vector<CostAndLoss> points(static_cast<size_t>(round % 40));
    for (CostAndLoss& p : points) {
      p = {double(value(random)), double(value(random))};
      if (value(random) == 0) p.loss = std::numeric_limits<double>::quiet_NaN();
      if (value(random) == 1) p.cost = std::numeric_limits<double>::infinity();
    }
    EXPECT_EQ(pareto_front(points), front_by_trying_all(points)) << "round " << round;
  }
}

TEST(ParetoFront, IsWhatNobodyBeats) {
  EXPECT_EQ(pareto_front({{3, 1}, {1, 3}, {2, 2}, {2, 3}, {3, 1}}), (std::vector<size_t>{1, 2, 0}));
  EXPECT_TRUE(pareto_front({}).empty());
}

}  // namespace
}  // namespace cgs::pareto_test
