// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/outliers.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::outliers_test {
namespace {

// A flat patch and some points far off it; outliers come last.
std::vector<Eigen::Vector3f> patch(size_t count, size_t outliers) {
  std::mt19937 random(3);
  const auto number = [&] { return float(random() % 100'000) / 100'000; };
  std::vector<Eigen::Vector3f> points;
  for (size_t i = 0; i < count; ++i) points.emplace_back(number(), number(), 0.001f * number());
  for (size_t i = 0; i < outliers; ++i) points.emplace_back(number(), number(), 1 + 4 * number());
  return points;
}

std::vector<double> sorted_distances(const std::vector<Eigen::Vector3f>& points, size_t from) {
  std::vector<double> out;
  for (const auto& p : points) out.push_back((p - points[from]).cast<double>().norm());
  std::sort(out.begin(), out.end());
  return out;
}

TEST(StatisticalOutliers, AreThoseOfTheDefinition) {
  const auto points = patch(600, 20);
  constexpr size_t kNeighbors = 12;
  std::vector<double> means;
  double sum = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto d = sorted_distances(points, i);
    double mean = 0;
    for (size_t k = 1; k <= kNeighbors; ++k) mean += d[k] / kNeighbors;
    means.push_back(mean);
    sum += mean;
  }
  const double mean = sum / double(points.size());
  double squares = 0;
  for (const double m : means) squares += (m - mean) * (m - mean);
  const double limit = mean + 1.5 * std::sqrt(squares / double(points.size() - 1));
  const auto keep = without_statistical_outliers(points, kNeighbors, 1.5);
  for (size_t i = 0; i < points.size(); ++i) EXPECT_EQ(keep[i] != 0, means[i] <= limit) << i;
  EXPECT_EQ(std::count(keep.begin(), keep.begin() + 600, 0), 0);
  EXPECT_GT(std::count(keep.begin() + 600, keep.end(), 0), 10);
}

TEST(LonelyPoints, AreThoseOfTheDefinition) {
  const auto points = patch(600, 20);
  constexpr double kRadius = 0.07;
  const auto keep = without_lonely_points(points, 8, kRadius);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto d = sorted_distances(points, i);
    const auto within = std::upper_bound(d.begin(), d.end(), kRadius) - d.begin() - 1;
    EXPECT_EQ(keep[i] != 0, within >= 8) << i;
  }
}

TEST(Outliers, TakeFewPointsAndRefuseNonsense) {
  EXPECT_TRUE(without_statistical_outliers({}, 5, 1).empty());
  EXPECT_EQ(without_statistical_outliers({{0, 0, 0}}, 5, 1), std::vector<uint8_t>{1});
  EXPECT_EQ(without_lonely_points({{0, 0, 0}}, 1, 1), std::vector<uint8_t>{0});
  EXPECT_THROW(without_statistical_outliers({}, 0, 1), InvalidInput);
  EXPECT_THROW(without_statistical_outliers({}, 1, std::nan("")), InvalidInput);
  EXPECT_THROW(without_lonely_points({}, 1, 0), InvalidInput);
}

}  // namespace
}  // namespace cgs::outliers_test
