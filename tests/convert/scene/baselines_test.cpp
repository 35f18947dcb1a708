// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/baselines.h"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"

namespace cgs::baselines_test {
namespace {

Scene scene_of(const std::vector<Eigen::Vector3d>& centers) {
  Scene scene;
  for (const Eigen::Vector3d& center : centers) {
    View view;
    view.name = "view " + std::to_string(scene.views.size());
    view.camera = test::looking_at(center, {0, 0, 0}, 640, 480, 500);
    view.near = 4;
    view.far = 6;
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
  }
  return scene;
}

TEST(Baselines, AreLengthsSharesOfDepthAndAngles) {
  const std::vector<Baseline> pairs = baselines(scene_of({{0, 0, -5}, {5, 0, 0}, {0, 0, 5}}));
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs[1].a, 0);
  EXPECT_EQ(pairs[1].b, 2);
  EXPECT_NEAR(pairs[1].length, 10, 1e-12);
  EXPECT_NEAR(pairs[1].to_depth, 10 / 4.8, 1e-9) << "harmonic middle of 4 and 6";
  EXPECT_NEAR(pairs[1].angle, std::numbers::pi, 1e-6);
  EXPECT_NEAR(pairs[0].angle, std::numbers::pi / 2, 1e-6);
}

// A point amid each cell of the left half of a picture, seen by two cameras in one place.
TEST(Overlap, IsWhereBothShowPoints) {
  Scene scene = scene_of({{0, 0, -5}, {0, 0, -5}, {1, 0, -5}});
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 4; ++column) {
      const Eigen::Vector3d at =
          scene.views[0].camera.unproject(80.0 * column + 40, 80.0 * row + 40, 5);
      scene.points.push_back({at, {0, 1}});
      scene.points.push_back({at, {0, 2}});
    }
  }
  scene.points.push_back({{0, 0, -50}, {0, 1}});  // behind both: in no cell
  const Overlap same = overlap(scene, 0, 1);
  EXPECT_EQ(same.points, 25U);
  EXPECT_DOUBLE_EQ(same.share, 0.5);
  const Overlap beside = overlap(scene, 0, 2);
  EXPECT_EQ(beside.points, 24U);
  EXPECT_GT(beside.share, 0);
  EXPECT_LE(beside.share, 0.5);
  const Overlap none = overlap(scene, 1, 2);
  EXPECT_EQ(none.points, 0U);
  EXPECT_DOUBLE_EQ(none.share, 0);
}

TEST(BaselineWarnings, NameWhatSharesTooLittleAndWhatTellsTooLittle) {
  EXPECT_TRUE(baseline_warnings(scene_of({{0, 0, -5}, {1, 0, -5}})).empty());
  const auto wide = baseline_warnings(scene_of({{0, 0, -5}, {1, 0, -5}, {5, 0, 0}}));
  ASSERT_EQ(wide.size(), 2U);
  EXPECT_NE(wide[0].find("views view 0 and view 2 look in directions more than 60 degrees apart"),
            std::string::npos)
      << wide[0];
  const auto near = baseline_warnings(scene_of({{0, 0, -5}, {0.05, 0, -5}}));
  ASSERT_EQ(near.size(), 1U);
  EXPECT_NE(near[0].find("below 2 % of the depth"), std::string::npos);
}

}  // namespace
}  // namespace cgs::baselines_test
