// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/clusters.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::clusters_test {
namespace {

constexpr float kRadius = 0.08f;
constexpr size_t kNeighbors = 6;

std::vector<Eigen::Vector3f> blobs() {
  std::mt19937 random(5);
  std::vector<Eigen::Vector3f> out;
  for (int i = 0; i < 900; ++i) {
    const auto number = [&] { return float(random() % 10'000) / 10'000; };
    const float blob = float(random() % 4);
    const float spread = i % 10 == 0 ? 1.5f : 0.3f;
    out.emplace_back(blob + spread * number(), spread * number(), spread * number());
  }
  return out;
}

bool near(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return (a - b).squaredNorm() <= kRadius * kRadius;
}

// By flooding: slow and plain.
std::vector<int> flooded(const std::vector<Eigen::Vector3f>& points, std::vector<bool>& dense) {
  dense.assign(points.size(), false);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto count = std::count_if(
        points.begin(), points.end(), [&](const auto& p) { return near(p, points[i]); });
    dense[i] = size_t(count) >= kNeighbors;
  }
  std::vector<int> part(points.size(), -1);
  int parts = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!dense[i] || part[i] >= 0) continue;
    std::vector<size_t> open = {i};
    part[i] = parts;
    while (!open.empty()) {
      const size_t a = open.back();
      open.pop_back();
      for (size_t b = 0; b < points.size(); ++b) {
        if (!dense[b] || part[b] >= 0 || !near(points[a], points[b])) continue;
        part[b] = parts;
        open.push_back(b);
      }
    }
    ++parts;
  }
  return part;
}

TEST(DenseClusters, AreThoseOfFlooding) {
  const auto points = blobs();
  std::vector<bool> dense;
  const std::vector<int> part = flooded(points, dense);
  const PointClusters found = dense_clusters(points, double(kRadius), kNeighbors);
  std::map<int, uint32_t> named;
  size_t sparse_members = 0;
  size_t noise = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (dense[i]) {
      EXPECT_EQ(found.of_point[i], named.try_emplace(part[i], found.of_point[i]).first->second);
      continue;
    }
    size_t host = points.size();
    for (size_t b = 0; b < points.size(); ++b) {
      if (!dense[b] || !near(points[i], points[b])) continue;
      const auto distance = [&](size_t k) { return (points[k] - points[i]).squaredNorm(); };
      if (host == points.size() || distance(b) < distance(host)) host = b;
    }
    ++(host == points.size() ? noise : sparse_members);
    const uint32_t expected = host == points.size() ? PointClusters::kNoise : found.of_point[host];
    EXPECT_EQ(found.of_point[i], expected) << i;
  }
  EXPECT_EQ(named.size(), found.size.size());
  EXPECT_GT(named.size(), 2U);
  EXPECT_GT(sparse_members, 5U);
  EXPECT_GT(noise, 5U);
}

TEST(DenseClusters, AreNumberedByTheirFirstPointAndCounted) {
  const std::vector<Eigen::Vector3f> points = {
      {9, 0, 0}, {0, 0, 0}, {9, 0, 0}, {4, 4, 4}, {0, 0, 0}};
  const PointClusters found = dense_clusters(points, 0.1, 2);
  EXPECT_EQ(found.of_point, (std::vector<uint32_t>{0, 1, 0, PointClusters::kNoise, 1}));
  EXPECT_EQ(found.size, (std::vector<size_t>{2, 2}));
  EXPECT_THROW(dense_clusters(points, 0, 2), InvalidInput);
}

}  // namespace
}  // namespace cgs::clusters_test
