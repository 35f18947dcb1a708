// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/continued_planes.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/measured_patches.h"

namespace cgs::continued_planes_test {
namespace {

using Eigen::Vector3d;
using test::MeasuredPatches;

// \return how many planes were found
size_t continue_all(MeasuredPatches& scene) {
  const auto planes = measured_planes(scene.scene, scene.priors);
  continue_planes(scene.scene, planes, 0.002f, scene.priors);
  return planes.size();
}

struct Result {
  double filled = 0;  // share of what the view shows and was not measured
  double wrong = 0;   // share of that whose depth is off by more than 2 %
};

Result result_of(const MeasuredPatches& scene, size_t v) {
  double open = 0;
  double filled = 0;
  double wrong = 0;
  for (size_t i = 0; i < scene.truth[v].data.size(); ++i) {
    const DepthOrigin origin = scene.priors[v].origin.data[i];
    if (origin == DepthOrigin::Measured || origin == DepthOrigin::Sky) continue;
    ++open;
    if (origin != DepthOrigin::Continued) continue;
    ++filled;
    const double ratio = double{scene.priors[v].depth.data[i] / scene.truth[v].data[i]};
    wrong += std::abs(ratio - 1) > 0.02 ? 1 : 0;
  }
  return {filled / open, filled > 0 ? wrong / filled : 0};
}

TEST(ContinuePlanes, BringsAStreetToOnesFeet) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  const auto before = street.priors;
  continue_all(street);
  for (size_t v = 0; v < 2; ++v) {
    const Result result = result_of(street, v);
    EXPECT_GT(result.filled, 0.9);
    EXPECT_LT(result.wrong, 0.03);
    for (size_t i = 0; i < before[v].depth.data.size(); ++i) {
      const DepthOrigin origin = before[v].origin.data[i];
      ASSERT_TRUE(origin == DepthOrigin::Unknown || origin == street.priors[v].origin.data[i]);
      if (origin != DepthOrigin::Measured) continue;
      ASSERT_EQ(before[v].depth.data[i], street.priors[v].depth.data[i]);
    }
  }
}

TEST(ContinuePlanes, TrustsThemLessTheFartherOneIsFromWhatWasMeasured) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  continue_all(street);
  const ViewPriors& priors = street.priors[0];
  const auto relative = [&](int y) { return priors.sigma(60, y) / priors.depth(60, y); };
  EXPECT_GT(relative(85), relative(75));
  EXPECT_GT(relative(75), 0.02f);
}

TEST(ContinuePlanes, ReplacesWhatWasEstimatedAndKeepsWhatAdjoinsMeasuredPixels) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  ViewPriors& priors = street.priors[0];
  priors.origin(60, 85) = DepthOrigin::Estimated;
  priors.origin(62, 85) = DepthOrigin::Completed;
  priors.depth(60, 85) = priors.depth(62, 85) = 10;
  continue_all(street);
  EXPECT_NEAR(priors.depth(60, 85), street.truth[0](60, 85), 0.05);
  EXPECT_EQ(priors.origin(60, 85), DepthOrigin::Continued);
  EXPECT_EQ(priors.depth(62, 85), 10);
  EXPECT_EQ(priors.origin(62, 85), DepthOrigin::Completed);
}

TEST(ContinuePlanes, LeavesMaskedPixels) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  street.scene.views[0].valid = MaskMap(MeasuredPatches::kWidth, MeasuredPatches::kHeight, 1);
  street.scene.views[0].valid(60, 85) = 0;
  continue_all(street);
  EXPECT_EQ(street.priors[0].origin(60, 85), DepthOrigin::Unknown);
  EXPECT_EQ(street.priors[0].origin(62, 85), DepthOrigin::Continued);
}

// What of a box is not measured is not the ground that would be behind it.
TEST(ContinuePlanes, LeavesThingsBeforeThemAlone) {
  auto patches = test::street();
  test::add_box(patches, {-1, 0.2, 8}, {1, 1.5, 9});
  MeasuredPatches street(patches);
  const auto on_box = [](int x, int y) { return x >= 52 && x < 68 && y >= 49 && y < 58; };
  street.keep([&](int x, int y, float z) {
    return z > 6 && z < 25 && !(on_box(x, y) && x >= 57 && x < 63);
  });
  continue_all(street);
  for (int y = 50; y < 57; ++y) {
    EXPECT_EQ(street.priors[0].origin(60, y), DepthOrigin::Unknown) << y;
  }
}

// Where a wall ends, something behind it was measured.
TEST(ContinuePlanes, EndsWhereSomethingBehindWasMeasured) {
  auto patches = test::street();
  patches[1].point.z() = 20;  // the left wall begins at 14
  patches[1].half_v = 6;
  patches.push_back({Vector3d(-12, -1, 20), Vector3d::UnitY(), Vector3d::UnitZ(), 2.5, 20});
  MeasuredPatches street(patches);
  street.keep([&](int x, int, float z) { return z > 6 && z < 25 && !(x > 10 && x < 16); });
  EXPECT_GE(continue_all(street), 2);
  const ViewPriors& priors = street.priors[0];
  for (int x = 11; x < 16; ++x) {
    const bool is_wall = priors.origin(x, 45) == DepthOrigin::Continued &&
                         std::abs(priors.depth(x, 45) * float(60 - x) / 80 - 2) < 0.1f;
    EXPECT_FALSE(is_wall) << x;
  }
}

// A wall with a gap that the other view looks through.
TEST(ContinuePlanes, EndsWhereAnotherViewSeesPast) {
  const std::vector<test::TexturedPatch> wall = {
      {Vector3d(0, 0, 8), Vector3d::UnitX(), Vector3d::UnitY(), 20, 20}};
  const auto in_gap = [](int x, int) { return x >= 50 && x < 70; };
  for (const DepthOrigin origin : {DepthOrigin::Measured, DepthOrigin::Sky, DepthOrigin::Unknown}) {
    MeasuredPatches scene(wall);
    scene.keep([&](int x, int y, float) { return !in_gap(x, y); });
    ViewPriors& other = scene.priors[1];
    for (int x = 45; x < 75 && origin != DepthOrigin::Unknown; ++x) {
      for (int y = 0; y < MeasuredPatches::kHeight; ++y) {
        other.origin(x, y) = origin;
        other.depth(x, y) = 20;
        other.sigma(x, y) = 0.01f;
      }
    }
    EXPECT_GE(continue_all(scene), 1);
    const bool is_filled = scene.priors[0].origin(60, 45) == DepthOrigin::Continued;
    EXPECT_EQ(is_filled, origin == DepthOrigin::Unknown);
  }
}

// A wall of which nothing is known below some height ends there.
TEST(ContinuePlanes, EndsWallsBelowWhatWasMeasuredOfThem) {
  MeasuredPatches wall({{Vector3d(0, 0, 8), Vector3d::UnitX(), Vector3d::UnitY(), 20, 20}});
  wall.keep([](int x, int y, float) { return y < 50 && (x < 50 || x >= 70); });
  EXPECT_EQ(continue_all(wall), 1);
  EXPECT_EQ(wall.priors[0].origin(60, 80), DepthOrigin::Unknown);
  EXPECT_NEAR(wall.priors[0].depth(60, 45), 8, 0.1);
}

TEST(ContinuePlanes, LeavesGroundThatIsSeenFromBelow) {
  MeasuredPatches street(test::street());
  const auto planes = measured_planes(street.scene, street.priors);
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  for (View& view : street.scene.views) view.camera.world_from_cam.translation().y() += 3;
  continue_planes(street.scene, planes, 0.002f, street.priors);
  for (int x = 50; x < 70; ++x) EXPECT_EQ(street.priors[0].origin(x, 85), DepthOrigin::Unknown);
}

TEST(ContinuePlanes, LeavesViewsOfWhichNothingWasMeasured) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  street.priors[1] = test::unmeasured_priors(MeasuredPatches::kWidth, MeasuredPatches::kHeight);
  EXPECT_EQ(continue_all(street), 3);
  for (const DepthOrigin origin : street.priors[1].origin.data) {
    ASSERT_EQ(origin, DepthOrigin::Unknown);
  }
}

}  // namespace
}  // namespace cgs::continued_planes_test
