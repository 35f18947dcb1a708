// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/kd_tree.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace cgs::kd_tree_test {
namespace {

// Half of the points on a coarse grid, so that many distances are equal and points coincide.
std::vector<Eigen::Vector3f> cloud(size_t count) {
  std::mt19937 random(7);
  std::vector<Eigen::Vector3f> points;
  for (size_t i = 0; i < count; ++i) {
    const auto number = [&] { return float(random() % 1000) / 1000 - 0.5f; };
    Eigen::Vector3f p(number(), number(), number());
    if (i % 2 == 0) p = (p * 4).array().round() / 4;
    points.push_back(p);
  }
  return points;
}

std::vector<Neighbor> sorted_by_distance(const std::vector<Eigen::Vector3f>& points,
                                         const Eigen::Vector3f& query) {
  std::vector<Neighbor> out;
  for (uint32_t p = 0; p < points.size(); ++p) {
    const Eigen::Vector3f d = points[p] - query;
    out.push_back({p, d.x() * d.x() + d.y() * d.y() + d.z() * d.z()});
  }
  std::stable_sort(out.begin(), out.end(), [](const Neighbor& a, const Neighbor& b) {
    return a.squared_distance < b.squared_distance;
  });
  return out;
}

TEST(KdTree, FindsWhatBruteForceFindsInItsOrder) {
  for (const size_t count : {1U, 2U, 16U, 17U, 33U, 700U}) {
    const std::vector<Eigen::Vector3f> points = cloud(count);
    const KdTree tree(points);
    std::vector<Neighbor> found;
    for (const Eigen::Vector3f& query : cloud(60)) {
      const std::vector<Neighbor> all = sorted_by_distance(points, query);
      for (const size_t k : {1U, 5U, 30U, 100U}) {
        tree.nearest(query, k, found);
        ASSERT_EQ(found.size(), std::min<size_t>(k, count));
        for (size_t i = 0; i < found.size(); ++i) {
          EXPECT_EQ(found[i].point, all[i].point) << count << " points, neighbour " << i;
          EXPECT_EQ(found[i].squared_distance, all[i].squared_distance);
        }
      }
    }
  }
}

TEST(KdTree, CountsAndListsWhatLiesWithinARadius) {
  const std::vector<Eigen::Vector3f> points = cloud(900);
  const KdTree tree(points);
  std::vector<Neighbor> found;
  for (const Eigen::Vector3f& query : cloud(80)) {
    for (const float radius : {0.01f, 0.25f, 0.5f, 3.0f}) {
      size_t expected = 0;
      for (const Neighbor& n : sorted_by_distance(points, query)) {
        if (n.squared_distance <= radius * radius) ++expected;
      }
      EXPECT_EQ(tree.count_within(query, radius, 10'000), expected);
      EXPECT_EQ(tree.count_within(query, radius, 7), std::min<size_t>(expected, 7));
      tree.within(query, radius, found);
      EXPECT_EQ(found.size(), expected);
      for (const Neighbor& n : found) EXPECT_LE((points[n.point] - query).norm(), radius * 1.0001f);
    }
  }
}

TEST(KdTree, OrderNamesEveryPointOnce) {
  std::vector<uint32_t> order = KdTree(cloud(500)).order();
  std::sort(order.begin(), order.end());
  for (uint32_t i = 0; i < order.size(); ++i) ASSERT_EQ(order[i], i);
}

TEST(KdTree, TakesNoPoints) {
  const KdTree tree({});
  std::vector<Neighbor> found = {{0, 0}};
  tree.nearest({0, 0, 0}, 3, found);
  EXPECT_TRUE(found.empty());
  EXPECT_EQ(tree.count_within({0, 0, 0}, 1, 5), 0U);
}

}  // namespace
}  // namespace cgs::kd_tree_test
