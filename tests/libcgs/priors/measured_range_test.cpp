// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/measured_range.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"

namespace cgs::measured_range_test {
namespace {

using Eigen::Vector3d;

// A wall at depth 6 with a square at depth 3 before it, in a scene that states no depth range.
Scene wall_and_square(double contrast) {
  const std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY(), 1e9, 1e9, contrast},
      {Vector3d(0, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 0.8, 0.8, contrast}};
  std::vector<Camera> cameras;
  for (const double x : {-0.25, 0.25}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 0, 4}, 320, 240, 300));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.06);
  to_canonical(scene);
  for (View& view : scene.views) view.near = view.far = 0;
  return scene;
}

TEST(NarrowDepthRanges, HoldWhatIsThereAndLittleMore) {
  Scene scene = wall_and_square(1);
  const DepthRange guess = depth_range(scene, 0);
  narrow_depth_ranges(scene, {});
  for (const View& view : scene.views) {
    EXPECT_LE(view.near * scene.frame.scale, 3);
    EXPECT_GE(view.far * scene.frame.scale, 6);
    EXPECT_GE(view.near * scene.frame.scale, 0.45 * 3) << "as chance matches of two views would";
    EXPECT_LT(1 / view.near - 1 / view.far, 0.85 * (1 / guess.near - 1 / guess.far));
  }
}

TEST(NarrowDepthRanges, KeepWhatAViewStates) {
  Scene scene = wall_and_square(1);
  for (View& view : scene.views) {
    view.near = 0.01;
    view.far = 5;
  }
  narrow_depth_ranges(scene, {});
  for (const View& view : scene.views) EXPECT_EQ(view.near, 0.01);
}

TEST(NarrowDepthRanges, NeverWidenTheGuessWhereTextureIsMissing) {
  Scene scene = wall_and_square(0);
  const DepthRange guess = depth_range(scene, 0);
  narrow_depth_ranges(scene, {});
  EXPECT_GE(depth_range(scene, 0).near, guess.near);
  EXPECT_LE(depth_range(scene, 0).far, guess.far);
}

// It covers 0.7 % of the middle picture, and stands half as far away as all else.
TEST(NarrowDepthRanges, HoldASmallThingInTheForeground) {
  std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 10), Vector3d::UnitX(), Vector3d::UnitY()}};
  test::add_box(patches, {-0.2, -0.18, 5}, {0.2, 0.18, 5.4});
  std::vector<Camera> cameras;
  for (const double x : {-0.4, 0.0, 0.4}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {x, 0, 10}, 480, 360, 450));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.04);
  const DepthMap truth = test::true_depth(patches, cameras[1]);
  const auto is_near = [](float z) { return z < 6; };
  const auto pixels = std::count_if(truth.data.begin(), truth.data.end(), is_near);
  ASSERT_NEAR(double(pixels) / double(truth.data.size()), 0.007, 0.001);
  to_canonical(scene);
  for (View& view : scene.views) view.near = view.far = 0;
  narrow_depth_ranges(scene, {});
  for (const View& view : scene.views) {
    EXPECT_LE(view.near * scene.frame.scale, 5);
    EXPECT_GE(view.far * scene.frame.scale, 10);
  }
}

// Its disparity is two pixels, in the small pictures half of one.
TEST(NarrowDepthRanges, HoldABackgroundThatHardlyMoves) {
  const std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 45), Vector3d::UnitX(), Vector3d::UnitY()},
      {Vector3d(2, 0, 4), Vector3d::UnitX(), Vector3d::UnitY(), 2, 4}};
  std::vector<Camera> cameras;
  for (const double x : {-0.25, 0.25}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {x, 0, 4}, 320, 240, 200));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.25);
  to_canonical(scene);
  for (View& view : scene.views) view.near = view.far = 0;
  ASSERT_GT(depth_range(scene, 0).far * scene.frame.scale, 45);
  narrow_depth_ranges(scene, {});
  for (const View& view : scene.views) {
    EXPECT_LE(view.near * scene.frame.scale, 4);
    EXPECT_GE(view.far * scene.frame.scale, 45);
  }
}

// Quarters of such pictures have four pixels, and none of them a depth.
TEST(NarrowDepthRanges, KeepTheGuessOfTinyPictures) {
  for (const int side : {8, 11}) {
    std::vector<Camera> cameras;
    for (const double x : {-0.25, 0.25}) {
      cameras.push_back(test::looking_at({x, 0, 0}, {x, 0, 4}, side, side, 8));
    }
    const std::vector<test::TexturedPatch> wall = {
        {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY()}};
    Scene scene = test::photographed_scene(wall, cameras, 0.5);
    to_canonical(scene);
    for (View& view : scene.views) view.near = view.far = 0;
    narrow_depth_ranges(scene, {});
    for (const View& view : scene.views) EXPECT_EQ(view.far, 0);
  }
}

}  // namespace
}  // namespace cgs::measured_range_test
