// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/pixel_matches.h"

#include <gtest/gtest.h>

namespace cgs::pixel_matches_test {
namespace {

constexpr float kDepth = 4;
constexpr int kShift = 2;  // of what the second camera sees of a wall at kDepth [pixels]

Camera camera_at(double x) {
  Camera camera{.width = 8, .height = 6, .fx = 8, .fy = 8, .cx = 4, .cy = 3};
  camera.world_from_cam.translation() = Eigen::Vector3d(x, 0, 0);
  return camera;
}

ViewPriors wall() {
  ViewPriors priors;
  priors.depth = DepthMap(8, 6, kDepth);
  priors.sigma = DepthMap(8, 6, 0.01f);
  priors.origin = Raster<DepthOrigin>(8, 6, DepthOrigin::Measured);
  return priors;
}

std::vector<PixelMatch> matches(const ViewPriors& own, const ViewPriors& other) {
  return pixel_matches(camera_at(0), own, camera_at(kShift * kDepth / 8), other);
}

TEST(PixelMatches, SayWhereTheOtherViewShowsThePixel) {
  const std::vector<PixelMatch> found = matches(wall(), wall());
  ASSERT_EQ(found.size(), 6u * (8 - kShift));
  EXPECT_EQ(found[0].pixel, kShift);
  for (const PixelMatch& match : found) {
    EXPECT_NEAR(match.u, match.pixel % 8 + 0.5 - kShift, 1e-5);
    EXPECT_NEAR(match.v, match.pixel / 8 + 0.5, 1e-5);
  }
}

TEST(PixelMatches, NeedDepthThatBothMeasured) {
  ViewPriors filled = wall();
  filled.origin(5, 2) = DepthOrigin::Completed;
  EXPECT_EQ(matches(filled, wall()).size(), matches(wall(), wall()).size() - 1);
  EXPECT_EQ(matches(wall(), filled).size(), matches(wall(), wall()).size() - 1);
}

TEST(PixelMatches, NeedDepthsThatAgree) {
  constexpr float kTolerance = 3 * 0.01f * 1.41421f + 0.005f * kDepth;
  ViewPriors other = wall();
  other.depth(3, 1) += 0.9f * kTolerance;
  other.depth(1, 4) += 1.1f * kTolerance;
  EXPECT_EQ(matches(wall(), other).size(), matches(wall(), wall()).size() - 1);
}

TEST(PixelMatches, ThereAreNoneWhereNothingWasMeasured) {
  ViewPriors nothing;
  nothing.depth = DepthMap(8, 6, kDepth);
  EXPECT_TRUE(matches(nothing, wall()).empty());
  EXPECT_TRUE(matches(wall(), nothing).empty());
}

}  // namespace
}  // namespace cgs::pixel_matches_test
