// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/camera_between.h"

#include <gtest/gtest.h>

#include "tests/support/planted_training.h"

namespace cgs::camera_between_test {
namespace {

TEST(CameraBetween, IsEitherCameraAtTheEndsAndHalfwayBetweenThem) {
  const test::PlantedScene planted = test::planted_scene(0);
  const Camera& a = planted.scene.views[0].camera;
  const Camera& b = planted.scene.views[2].camera;
  EXPECT_TRUE(camera_between(a, b, 0).world_from_cam.isApprox(a.world_from_cam, 1e-12));
  EXPECT_TRUE(camera_between(a, b, 1).world_from_cam.isApprox(b.world_from_cam, 1e-12));
  const Camera half = camera_between(a, b, 0.5);
  EXPECT_TRUE(half.center().isApprox(0.5 * (a.center() + b.center()), 1e-12));
  const auto angle_to = [&](const Camera& other) {
    return Eigen::Quaterniond(half.world_from_cam.rotation())
        .angularDistance(Eigen::Quaterniond(other.world_from_cam.rotation()));
  };
  EXPECT_NEAR(angle_to(a), angle_to(b), 1e-9);
}

}  // namespace
}  // namespace cgs::camera_between_test
