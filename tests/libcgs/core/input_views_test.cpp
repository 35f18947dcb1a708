// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/input_views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::input_views_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

View view_from(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  View view;
  view.camera = {.width = 64, .height = 48, .fx = 90, .fy = 90, .cx = 32, .cy = 24};
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  view.camera.world_from_cam.linear() << x, z.cross(x), z;
  view.camera.world_from_cam.translation() = center;
  return view;
}

Eigen::Vector3d on_ring(double degrees, double radius) {
  return {radius * std::sin(degrees * kDegree), 0, -radius * std::cos(degrees * kDegree)};
}

// Cameras all around a cylinder, so many degrees apart.
Scene ring(int count, double apart) {
  Scene scene;
  scene.folder = "ring";
  for (int i = 0; i < count; ++i) {
    scene.views.push_back(view_from(on_ring(apart * i, 4), Eigen::Vector3d::Zero()));
  }
  return scene;
}

// Points on the cylinder, each seen by the cameras on its side.
void add_points(Scene& scene, double apart) {
  for (int degrees = 0; degrees < 360; ++degrees) {
    SparsePoint point{on_ring(degrees, 1), {}};
    for (size_t i = 0; i < scene.views.size(); ++i) {
      const double off = std::remainder(apart * double(i) - degrees, 360);
      if (std::abs(off) < 60) point.views.push_back(static_cast<int>(i));
    }
    scene.points.push_back(point);
  }
}

// Points around 90 degrees alone.
void keep_one_side(Scene& scene) {
  std::erase_if(scene.points, [](const SparsePoint& point) { return point.position.x() < 0.3; });
}

std::vector<int> all_of(const Scene& scene) {
  std::vector<int> out;
  for (size_t i = 0; i < scene.views.size(); ++i) out.push_back(static_cast<int>(i));
  return out;
}

// Views that lie next to each other on a ring of sixteen.
bool are_neighbors(const std::vector<int>& views) {
  for (int first = 0; first < 16; ++first) {
    std::vector<int> run = {first, (first + 1) % 16, (first + 2) % 16};
    std::sort(run.begin(), run.end());
    if (views == run) return true;
  }
  return false;
}

TEST(ChooseInputViews, TakesNeighborsOfARing) {
  Scene scene = ring(16, 22.5);
  add_points(scene, 22.5);
  const std::vector<int> chosen = choose_input_views(scene, all_of(scene), 3);
  EXPECT_TRUE(are_neighbors(chosen)) << testing::PrintToString(chosen);
}

TEST(ChooseInputViews, GuessesWhatIsSeenWherePointsDoNotSay) {
  const Scene scene = ring(16, 22.5);
  const std::vector<int> chosen = choose_input_views(scene, all_of(scene), 3);
  EXPECT_TRUE(are_neighbors(chosen)) << testing::PrintToString(chosen);
}

TEST(ChooseInputViews, TakesNoneThatAreNextToEachOtherInAFilm) {
  Scene scene = ring(120, 1);
  add_points(scene, 1);
  const std::vector<int> chosen = choose_input_views(scene, all_of(scene), 3);
  ASSERT_EQ(chosen.size(), 3u);
  for (int i = 0; i < 2; ++i) {
    EXPECT_GE(chosen[i + 1] - chosen[i], 6);
    EXPECT_LE(chosen[i + 1] - chosen[i], 45);
  }
}

TEST(ChooseInputViews, ChoosesAmongTheCandidatesAlone) {
  Scene scene = ring(16, 22.5);
  add_points(scene, 22.5);
  EXPECT_EQ(choose_input_views(scene, {3, 4, 9, 13}, 3), (std::vector<int>{3, 4}));
}

TEST(ChooseInputViews, TheViewsThatShowTheMost) {
  Scene scene = ring(16, 22.5);
  add_points(scene, 22.5);
  keep_one_side(scene);
  const std::vector<int> chosen = choose_input_views(scene, all_of(scene), 3);
  EXPECT_EQ(chosen, (std::vector<int>{3, 4, 5}));  // at 67.5, 90 and 112.5 degrees
}

TEST(ChooseInputViews, IsTheSameInSurveyedCoordinatesAndOtherUnits) {
  Scene scene = ring(16, 22.5);
  add_points(scene, 22.5);
  keep_one_side(scene);
  const std::vector<int> expected = choose_input_views(scene, all_of(scene), 3);
  const Eigen::Vector3d origin(4.5e6, -2e5, 5e6);
  for (View& view : scene.views) {
    auto place = view.camera.world_from_cam.translation();
    place = 1024 * place + origin;
  }
  for (SparsePoint& point : scene.points) point.position = 1024 * point.position + origin;
  EXPECT_EQ(choose_input_views(scene, all_of(scene), 3), expected);
}

TEST(ChooseInputViews, TakesNoTwoFromOnePlace) {
  Scene scene = ring(16, 22.5);
  for (int i = 0; i < 16; ++i) scene.views.push_back(scene.views[i]);
  add_points(scene, 22.5);  // the second round goes on around the ring
  std::vector<int> chosen = choose_input_views(scene, all_of(scene), 3);
  for (int& view : chosen) view %= 16;
  std::sort(chosen.begin(), chosen.end());
  EXPECT_TRUE(are_neighbors(chosen)) << testing::PrintToString(chosen);
  scene.points.clear();
  chosen = choose_input_views(scene, all_of(scene), 3);
  EXPECT_TRUE(are_neighbors(chosen)) << testing::PrintToString(chosen);
}

TEST(ChooseInputViews, TakesThoseThatMovedWhereMostStoodOnATripod) {
  Scene scene;
  for (int i = 0; i < 20; ++i) {
    const double degrees = i < 16 ? 0 : 10.0 * (i - 15);
    scene.views.push_back(view_from(on_ring(degrees, 4), Eigen::Vector3d::Zero()));
  }
  const std::vector<int> chosen = choose_input_views(scene, all_of(scene), 3);
  ASSERT_EQ(chosen.size(), 3u);
  EXPECT_GT(chosen[1], 15);
}

TEST(ChooseInputViews, TakesAsManyAsAreAskedForOfHundreds) {
  Scene scene = ring(360, 1);
  add_points(scene, 1);
  scene.points.push_back({Eigen::Vector3d::Constant(1e200), {0, 40, 80}});  // as a file may say
  const std::vector<int> chosen = choose_input_views(scene, all_of(scene), 5);
  ASSERT_EQ(chosen.size(), 5u);
  for (int i = 0; i < 4; ++i) EXPECT_GE(chosen[i + 1] - chosen[i], 6);
}

TEST(ChooseInputViews, TakesPairsOfOtherSides) {
  // Three pairs, 120 degrees apart: no single view adds anything to one of them.
  Scene scene;
  scene.folder = "pairs";
  for (const double degrees : {0, 10, 120, 130, 240, 250}) {
    scene.views.push_back(view_from(on_ring(degrees, 4), Eigen::Vector3d::Zero()));
  }
  EXPECT_EQ(choose_input_views(scene, all_of(scene), 6), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(choose_input_views(scene, all_of(scene), 5).size(), 4u);
}

TEST(ChooseInputViews, SaysThatNothingIsSeenTogether) {
  Scene scene;
  for (int i = 0; i < 5; ++i) {  // away from each other
    scene.views.push_back(view_from(on_ring(72 * i, 1), on_ring(72 * i, 2)));
  }
  EXPECT_TRUE(choose_input_views(scene, all_of(scene), 3).empty());
}

TEST(ChooseInputViews, RefusesOneCandidateAndTakesNoneOfOneCentre) {
  Scene scene = ring(5, 20);
  EXPECT_THROW(choose_input_views(scene, {2}, 3), InvalidInput);
  for (View& view : scene.views) view.camera.world_from_cam.translation().setZero();
  EXPECT_TRUE(choose_input_views(scene, all_of(scene), 3).empty());
}

}  // namespace
}  // namespace cgs::input_views_test
