// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/hidden_points.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/sphere_cloud.h"

namespace cgs::hidden_points_test {
namespace {

// A point of a ball is seen from a place at distance d if its height above the center is > 1 / d.
TEST(SeenFrom, OfABallWhatLiesBeforeTheHorizon) {
  const auto points = test::sphere_cloud(20'000).vertices;
  for (const double distance : {1.5, 3.0, 1000.0}) {
    const Eigen::Vector3d eye = distance * Eigen::Vector3d(1, -2, 2) / 3;
    const std::vector<uint8_t> seen = seen_from(points, eye);
    double share = 0;
    for (size_t v = 0; v < points.size(); ++v) {
      share += seen[v] / 20'000.0;
      const double height = points[v].cast<double>().dot(eye) / distance;
      // Near the horizon points need not lie behind others by as much as the eye allows.
      if (height > 1 / distance + 0.01) EXPECT_EQ(seen[v], 1) << distance << " " << height;
      if (height < 1 / distance - 0.2) EXPECT_EQ(seen[v], 0) << distance << " " << height;
    }
    EXPECT_NEAR(share, (1 - 1 / distance) / 2, 0.03) << distance;
  }
}

TEST(SeenFrom, WithinABallAllOfIt) {
  const auto points = test::sphere_cloud(3000).vertices;
  const std::vector<uint8_t> seen = seen_from(points, {0.3, 0.2, -0.4});
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 3000);
}

TEST(SeenFrom, NothingOfWhatLiesBehindAWall) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 10'000; ++i) {
    points.emplace_back(0.02f * float(i % 100) - 1, 0.02f * float(i / 100) - 1, 0.0f);
  }
  for (const auto& p : test::sphere_cloud(2000).vertices) {
    points.emplace_back(0.4f * p - Eigen::Vector3f(0, 0, 0.6f));
  }
  const std::vector<uint8_t> before = seen_from(points, {0.1, 0.2, 3});
  EXPECT_EQ(std::count(before.begin(), before.begin() + 10'000, 1), 10'000);
  EXPECT_EQ(std::count(before.begin() + 10'000, before.end(), 1), 0);
  const std::vector<uint8_t> behind = seen_from(points, {0.1, 0.2, -3});
  EXPECT_NEAR(double(std::count(behind.begin() + 10'000, behind.end(), 1)) / 2000, 0.42, 0.05);
  EXPECT_LT(std::count(behind.begin(), behind.begin() + 10'000, 1), 9000);
}

TEST(SeenFrom, PointsInOnePlaceAreSeenTogether) {
  auto points = test::sphere_cloud(500).vertices;
  const std::vector<uint8_t> once = seen_from(points, {0, 0, 5});
  points.insert(points.end(), points.begin(), points.begin() + 500);
  const std::vector<uint8_t> twice = seen_from(points, {0, 0, 5});
  EXPECT_TRUE(std::equal(twice.begin(), twice.begin() + 500, twice.begin() + 500));
  EXPECT_GT(std::count(once.begin(), once.end(), 1), 100);
}

TEST(SeenFrom, RefusesWhatHasNoOutside) {
  const std::vector<Eigen::Vector3f> three = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_THROW(seen_from(three, {0, 0, 5}), InvalidInput);
  const std::vector<Eigen::Vector3f> flat = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  EXPECT_THROW(seen_from(flat, {5, 0, 0}), NumericalError);
  EXPECT_EQ(seen_from(flat, {0, 0, 5}), (std::vector<uint8_t>{1, 1, 1, 1}));
}

}  // namespace
}  // namespace cgs::hidden_points_test
