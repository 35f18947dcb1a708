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
