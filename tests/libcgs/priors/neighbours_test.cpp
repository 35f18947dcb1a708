// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/neighbours.h"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"

namespace cgs::neighbours_test {
namespace {

constexpr double kAround = 2 * std::numbers::pi;

// Cameras on a circle of radius 4 that look at its middle, where a thing of size 1 stands.
Scene circle_of(int count) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    const double angle = kAround * i / count;
    View view;
    view.name = "v" + std::to_string(i);
    view.camera = test::looking_at(
        {4 * std::sin(angle), 0, 4 * std::cos(angle)}, Eigen::Vector3d::Zero(), 80, 60, 90);
    view.near = 3.5;
    view.far = 4.5;
    scene.views.push_back(view);
    scene.input.push_back(i);
  }
  return scene;
}

int steps_apart(size_t a, size_t b, int count) {
  const int steps = std::abs(static_cast<int>(a) - static_cast<int>(b));
  return std::min(steps, count - steps);
}

TEST(Neighbours, AreAllOthersWhereThereAreFew) {
  EXPECT_EQ(neighbours(circle_of(4), 1, 8), (std::vector<size_t>{0, 2, 3}));
  EXPECT_EQ(neighbours(circle_of(9), 0, 8).size(), 8u);
}

TEST(Neighbours, StandBesideTheViewToBothSides) {
  constexpr int kCount = 36;  // ten degrees apart
  for (const size_t view : {size_t{0}, size_t{17}}) {
    const std::vector<size_t> found = neighbours(circle_of(kCount), view, 4);
    ASSERT_EQ(found.size(), 4u);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    for (const size_t other : found) EXPECT_LE(steps_apart(other, view, kCount), 2);
  }
}

TEST(NeighbouringPairs, AreAllOfFewAndNearOnesOfMany) {
  EXPECT_EQ(neighbouring_pairs(circle_of(3)),
            (std::vector<std::pair<size_t, size_t>>{{0, 1}, {0, 2}, {1, 2}}));
  constexpr int kCount = 36;
  const auto pairs = neighbouring_pairs(circle_of(kCount));
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  EXPECT_LE(pairs.size(), kCount * kMostCompared);
  for (const auto& [a, b] : pairs) {
    EXPECT_LT(a, b);
    EXPECT_LE(steps_apart(a, b, kCount), 9);
  }
  EXPECT_EQ(std::count(pairs.begin(), pairs.end(), std::pair<size_t, size_t>(0, kCount - 1)), 1);
}

TEST(Neighbours, LookAtTheSame) {
  Scene scene = circle_of(12);
  scene.views[1].camera.world_from_cam.rotate(
      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  const std::vector<size_t> found = neighbours(scene, 0, 4);
  EXPECT_EQ(std::count(found.begin(), found.end(), size_t{1}), 0);
  EXPECT_EQ(std::count(found.begin(), found.end(), size_t{11}), 1);
}

TEST(Neighbours, AreNoneWhereAllStandInOnePlace) {
  Scene scene = circle_of(12);
  for (View& view : scene.views) view.camera = scene.views[0].camera;
  EXPECT_TRUE(neighbours(scene, 3, 4).empty());
}

}  // namespace
}  // namespace cgs::neighbours_test
