// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/down_sampling.h"

#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"

namespace cgs::down_sampling_test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

TEST(DownSampling, AveragesTheMembersOfEveryCube) {
  std::mt19937 random(11);
  TriangleMesh cloud;
  cloud.vertices.emplace_back(-1, -1, -1);  // corner of the grid
  for (int i = 0; i < 2000; ++i) {
    const auto number = [&] { return 2 * float(random() % 4096) / 4096 - 1; };
    cloud.vertices.emplace_back(number(), number(), number());
  }
  for (const auto& p : cloud.vertices) cloud.colors.emplace_back(0.5f * p.array() + 0.5f);
  constexpr double kSide = 0.3;
  using Cell = std::array<int, 3>;
  std::map<Cell, std::pair<Eigen::Vector3d, int>> cubes;
  const auto cell_of = [&](const Eigen::Vector3f& p) {
    Cell cell{};
    for (int k = 0; k < 3; ++k) cell.at(size_t(k)) = int(std::floor((double(p[k]) + 1) / kSide));
    return cell;
  };
  for (const auto& p : cloud.vertices) {
    auto& [sum, count] = cubes.try_emplace(cell_of(p), Eigen::Vector3d::Zero(), 0).first->second;
    sum += p.cast<double>();
    ++count;
  }
  const TriangleMesh out = down_sampled(cloud, kSide);
  ASSERT_EQ(out.vertices.size(), cubes.size());
  for (size_t v = 0; v < out.vertices.size(); ++v) {
    const auto found = cubes.find(cell_of(out.vertices[v]));
    ASSERT_NE(found, cubes.end());
    const Eigen::Vector3d mean = found->second.first / found->second.second;
    EXPECT_NEAR((out.vertices[v].cast<double>() - mean).norm(), 0, 1e-6);
    EXPECT_NEAR((out.colors[v] - (0.5f * out.vertices[v].array() + 0.5f).matrix()).norm(), 0, 1e-5);
  }
}

TEST(DownSampling, SigmaDoesNotShrinkAndUnsurePointsDoNotPull) {
  TriangleMesh cloud;
  cloud.vertices = {{0, 0, 0}, {0.1f, 0, 0}, {0.9f, 0, 0}, {5, 0, 0}, {5.5f, 0, 0}};
  cloud.sigma = {0.3f, 0.4f, kNaN, kNaN, kNaN};
  cloud.support = {2, 3, 0, 1, 0};
  const TriangleMesh out = down_sampled(cloud, 1);
  ASSERT_EQ(out.vertices.size(), 2U);
  EXPECT_NEAR(out.vertices[0].x(), 0.05f, 1e-7f);  // the third point has no say
  EXPECT_NEAR(out.sigma[0], std::sqrt((0.09 + 0.16) / 2), 1e-6);
  EXPECT_EQ(out.support[0], 2);
  EXPECT_NEAR(out.vertices[1].x(), 5.25f, 1e-6f);
  EXPECT_TRUE(std::isnan(out.sigma[1]));
  EXPECT_EQ(out.support[1], 0);
}

TEST(DownSampling, RefusesMeshesAndGridsBeyondCounting) {
  TriangleMesh cloud;
  cloud.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_THROW(down_sampled(cloud, 1e-8), InvalidInput);
  EXPECT_THROW(down_sampled(cloud, 0), InvalidInput);
  cloud.faces = {{0, 1, 2}};
  EXPECT_THROW(down_sampled(cloud, 1), InvalidInput);
  EXPECT_EQ(test::message_of([&] { down_sampled(cloud, 1); }),
            "thinning by cubes needs a point cloud: the number of faces must be 0, but is 1");
}

}  // namespace
}  // namespace cgs::down_sampling_test
