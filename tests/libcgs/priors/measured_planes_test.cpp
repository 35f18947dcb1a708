// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/measured_planes.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/measured_patches.h"

namespace cgs::measured_planes_test {
namespace {

using Eigen::Vector3d;
using test::MeasuredPatches;

// Whether one of the planes has this normal, up to its sign, and goes through the point.
bool has_plane(const std::vector<MeasuredPlane>& planes,
               const Vector3d& normal,
               const Vector3d& p) {
  return std::any_of(planes.begin(), planes.end(), [&](const MeasuredPlane& found) {
    return std::abs(found.plane.normal().dot(normal)) > 0.999 && found.plane.absDistance(p) < 0.03;
  });
}

TEST(MeasuredPlanes, AreGroundAndWallsOfAStreet) {
  const MeasuredPatches street(test::street());
  const auto planes = measured_planes(street.scene, street.priors);
  ASSERT_EQ(planes.size(), 3);
  EXPECT_TRUE(has_plane(planes, Vector3d::UnitY(), {0, 1.5, 5}));
  EXPECT_TRUE(has_plane(planes, Vector3d::UnitX(), {-2, 0, 5}));
  EXPECT_TRUE(has_plane(planes, Vector3d::UnitX(), {3, 0, 5}));
  for (const MeasuredPlane& found : planes) {
    const bool is_ground = std::abs(found.plane.normal().y()) > 0.9;
    EXPECT_EQ(std::isinf(found.lowest), is_ground);
    if (!is_ground) EXPECT_NEAR(found.lowest, -1.5, 0.2);  // upwards: -y
  }
}

TEST(MeasuredPlanes, AreFoundFarAway) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 6 && z < 25; });
  const auto planes = measured_planes(street.scene, street.priors);
  ASSERT_EQ(planes.size(), 3);
  EXPECT_TRUE(has_plane(planes, Vector3d::UnitY(), {0, 1.5, 5}));
}

TEST(MeasuredPlanes, AreFoundInManyViews) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float z) { return z > 3 && z < 25; });
  Scene many = street.scene;
  many.views.clear();
  many.input.clear();
  std::vector<ViewPriors> priors;
  for (int i = 0; i < 100; ++i) {
    many.input.push_back(i);
    many.views.push_back(street.scene.views[static_cast<size_t>(i % 2)]);
    priors.push_back(street.priors[static_cast<size_t>(i % 2)]);
  }
  EXPECT_EQ(measured_planes(many, priors).size(), 3);
}

TEST(MeasuredPlanes, AreNoneWhereUpIsNotKnown) {
  MeasuredPatches street(test::street());
  street.scene.frame.up.setZero();
  EXPECT_TRUE(measured_planes(street.scene, street.priors).empty());
}

TEST(MeasuredPlanes, AreNoneOfWhatIsNotMeasured) {
  MeasuredPatches street(test::street());
  street.keep([](int, int, float) { return false; });
  EXPECT_TRUE(measured_planes(street.scene, street.priors).empty());
}

// Slices of a ball look like planes, too.
TEST(MeasuredPlanes, AreNoneOfABall) {
  MeasuredPatches ball({{Vector3d(0, 0, 4), Vector3d::UnitX(), Vector3d::UnitY(), 3, 3}});
  const Vector3d centre(0, 0, 5);
  for (size_t v = 0; v < ball.priors.size(); ++v) {
    const Camera& camera = ball.scene.views[v].camera;
    ViewPriors& priors = ball.priors[v] =
        test::unmeasured_priors(MeasuredPatches::kWidth, MeasuredPatches::kHeight);
    for (int y = 0; y < priors.depth.height; ++y) {
      for (int x = 0; x < priors.depth.width; ++x) {
        const Vector3d ray = camera.ray_in_cam(x + 0.5, y + 0.5);
        const Vector3d to = centre - camera.center();
        const double along = ray.dot(to) / ray.squaredNorm();
        const double within = 2.25 - (to - along * ray).squaredNorm();
        if (within <= 0) continue;
        priors.depth(x, y) = static_cast<float>(along - std::sqrt(within) / ray.norm());
        priors.origin(x, y) = DepthOrigin::Measured;
      }
    }
  }
  EXPECT_TRUE(measured_planes(ball.scene, ball.priors).empty());
}

TEST(MeasuredPlanes, AreNoTableTop) {
  std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 1.5, 10), Vector3d::UnitX(), Vector3d::UnitZ(), 10, 20},
      {Vector3d(0, 0.8, 4), Vector3d::UnitX(), Vector3d::UnitZ(), 1.5, 1}};
  const MeasuredPatches table(patches);
  const auto planes = measured_planes(table.scene, table.priors);
  ASSERT_EQ(planes.size(), 1);
  EXPECT_TRUE(has_plane(planes, Vector3d::UnitY(), {0, 1.5, 5}));
}

TEST(MeasuredPlanes, AreNoRamp) {
  const Vector3d along = Vector3d(0, -0.5, 1).normalized();
  const MeasuredPatches ramp({{Vector3d(0, 1, 4), Vector3d::UnitX(), along, 5, 3}});
  EXPECT_TRUE(measured_planes(ramp.scene, ramp.priors).empty());
}

}  // namespace
}  // namespace cgs::measured_planes_test
