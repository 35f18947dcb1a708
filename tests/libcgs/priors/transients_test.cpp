// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/transients.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/priors/plane_sweep.h"
#include "tests/support/stereo_scene.h"

namespace cgs::transients_test {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// A wall with a square before it, seen from three or two places.
Scene wall_and_square(std::vector<double> places = {-0.3, 0, 0.3}) {
  const std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY()},
      {Vector3d(0.5, 0.3, 3.5), Vector3d::UnitX(), Vector3d::UnitY(), 0.5, 0.5}};
  std::vector<Camera> cameras;
  for (const double x : places) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 0, 4}, kWidth, kHeight, 150));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.06);
  to_canonical(scene);
  return scene;
}

/// A walker, as large as people are in photographs of buildings: an upright ellipse in two colours.
struct Walker {
  double x, y;

  bool covers(int px, int py) const { return std::hypot((px - x) / 10, (py - y) / 24) < 1; }
  void walk_into(View& view) const {
    for (int py = 0; py < kHeight; ++py) {
      for (int px = 0; px < kWidth; ++px) {
        if (!covers(px, py)) continue;
        view.image(px, py) =
            py < y ? Eigen::Vector3f(0.9f, 0.1f, 0.15f) : Eigen::Vector3f(0.05f, 0.1f, 0.6f);
      }
    }
  }
};

std::vector<MaskMap> found_in(const Scene& scene) {
  return find_transients(scene, plane_sweep(scene, {}));
}

size_t count(const MaskMap& mask) {
  return size_t(std::count(mask.data.begin(), mask.data.end(), 1));
}

TEST(FindTransients, FindsNothingWhereNothingMoved) {
  for (const MaskMap& mask : found_in(wall_and_square())) EXPECT_TRUE(mask.empty());
}

// Each photograph has its own, elsewhere.
TEST(FindTransients, FindsWalkersWhole) {
  Scene scene = wall_and_square();
  const std::vector<Walker> walkers = {{45, 50}, {70, 70}, {30, 80}};
  for (size_t i = 0; i < 3; ++i) walkers[i].walk_into(scene.views[i]);
  const std::vector<MaskMap> found = found_in(scene);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_FALSE(found[i].empty()) << i;
    size_t covered = 0;
    size_t all = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (!walkers[i].covers(x, y)) continue;
        ++all;
        covered += found[i](x, y);
      }
    }
    EXPECT_GT(double(covered), 0.9 * double(all)) << i;
    EXPECT_LT(double(count(found[i]) - covered), 0.5 * double(all)) << i;
  }
}

/// Stands a red post at a place in all pictures that have it: matching finds no depth on it, and
/// the wall behind is seen from both sides.
void stand_post(const Vector3d& place, Scene& scene) {
  for (View& view : scene.views) {
    const Vector3d foot = view.camera.project(scene.frame.internal_from_world(place));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (std::abs(x + 0.5 - foot.x()) < 7) view.image(x, y) = Eigen::Vector3f(0.9f, 0.1f, 0.1f);
      }
    }
  }
}

TEST(FindTransients, LeavesABarePostThatStandsStill) {
  Scene scene = wall_and_square();
  stand_post({-0.6, 0, 3}, scene);
  for (const MaskMap& mask : found_in(scene)) EXPECT_TRUE(mask.empty()) << count(mask);
}

// It is left of the third picture, which shows the wall behind it all the same.
TEST(FindTransients, LeavesAPostThatOneOfThreePicturesDoesNotHold) {
  Scene scene = wall_and_square();
  const Vector3d post(-0.75, 0, 1.5);
  stand_post(post, scene);
  ASSERT_LT(scene.views[2].camera.project(scene.frame.internal_from_world(post)).x(), -7);
  for (const MaskMap& mask : found_in(scene)) EXPECT_TRUE(mask.empty()) << count(mask);
}

TEST(FindTransients, CannotTellByTwoPhotographs) {
  Scene scene = wall_and_square({-0.3, 0.3});
  Walker{45, 50}.walk_into(scene.views[0]);
  for (const MaskMap& mask : found_in(scene)) EXPECT_TRUE(mask.empty());
}

TEST(EnterTransients, LeavesNoDepthAndNoPicture) {
  Scene scene = wall_and_square();
  std::vector<ViewPriors> priors = plane_sweep(scene, {});
  MaskMap mask(kWidth, kHeight, 0);
  mask(20, 30) = 1;
  enter_transients(mask, priors[0]);
  EXPECT_EQ(priors[0].origin(20, 30), DepthOrigin::Transient);
  EXPECT_TRUE(std::isnan(priors[0].depth(20, 30)));
  EXPECT_TRUE(std::isnan(priors[0].sigma(20, 30)));
  View& view = scene.views[0];
  mask_other_than_scene(priors[0], view);
  EXPECT_EQ(std::count(view.valid.data.begin(), view.valid.data.end(), 0), 1);
  EXPECT_EQ(view.valid(20, 30), 0);
  mask_other_than_scene(priors[1], scene.views[1]);
  EXPECT_TRUE(scene.views[1].valid.empty());
}

}  // namespace
}  // namespace cgs::transients_test
