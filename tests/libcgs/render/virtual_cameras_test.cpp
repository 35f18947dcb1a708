// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/virtual_cameras.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/loss_checks.h"
#include "tests/support/splat_shapes.h"

namespace cgs::virtual_cameras_test {
namespace {

const Eigen::Vector3d kCenter(0.1, -0.2, 0.3);

bool shows_the_ball(const Camera& camera, const Eigen::Vector3d& center, double radius) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-radius, radius}) {
      const Eigen::Vector3d p = center + side * Eigen::Vector3d::Unit(axis);
      if (!camera.sees(camera.project(p))) return false;
    }
  }
  return true;
}

TEST(VirtualCameras, SurroundAnObject) {
  Gaussians g;
  test::add_sphere(g, kCenter, 0.3, 2000);
  const VirtualCameras out = virtual_cameras(g, {.views = 24, .size = 128});
  EXPECT_FALSE(out.inside);
  ASSERT_EQ(out.cameras.size(), 24u);
  EXPECT_GT(out.coverage, 0.97);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Camera& camera : out.cameras) {
    EXPECT_TRUE(shows_the_ball(camera, kCenter, 0.3));
    EXPECT_NEAR(camera.world_from_cam.linear().determinant(), 1, 1e-12);
    mean += (camera.center() - kCenter).normalized() / 24;
  }
  EXPECT_LT(mean.norm(), 0.05);  // from all sides alike
}

TEST(VirtualCameras, AreNotMisledByFlyawaysAndHaze) {
  Gaussians g;
  test::add_sphere(g, kCenter, 0.3, 2000);
  for (int i = 0; i < 20; ++i) {
    test::add_disc(g, {1000.0 + i, -500, 20}, Eigen::Vector3d::UnitX(), 0.01);
  }
  for (int i = 0; i < 4000; ++i) {
    test::add_disc(g, {0, 5.0 + 0.001 * i, 0}, Eigen::Vector3d::UnitX(), 0.01);
    g.opacity.back() = 0.02f;
  }
  const VirtualCameras out = virtual_cameras(g, {.views = 8, .size = 128});
  for (const Camera& camera : out.cameras) {
    EXPECT_LT((camera.center() - kCenter).norm(), 1.2);
    EXPECT_TRUE(shows_the_ball(camera, kCenter, 0.3));
  }
}

// Nobody outside sees what stands in a closed room.
TEST(VirtualCameras, EnterARoom) {
  Gaussians g;
  test::add_cube(g, kCenter, 0.4, 24);
  for (const double x : {-0.25, 0.0, 0.25}) {
    for (const double z : {-0.25, 0.25}) {
      test::add_sphere(g, kCenter + Eigen::Vector3d(x, 0.25, z), 0.08, 900);
    }
  }
  const VirtualCameras best = virtual_cameras(g, {.views = 36, .size = 128});
  EXPECT_TRUE(best.inside);
  EXPECT_EQ(best.cameras.size(), 36u);
  EXPECT_GT(best.coverage, 0.8);  // the rest faces walls or lies between balls
  EXPECT_LT(best.coverage_of_other_placement, 0.6);
  for (const Camera& camera : best.cameras) {
    EXPECT_LT((camera.center() - kCenter).cwiseAbs().maxCoeff(), 0.4);
  }
  const VirtualCameras outside =
      virtual_cameras(g, {.placement = VirtualPlacement::Outside, .views = 36, .size = 128});
  EXPECT_FALSE(outside.inside);
  EXPECT_NEAR(outside.coverage, best.coverage_of_other_placement, 1e-12);
}

TEST(VirtualCameras, AreTheSameForAnyNumberOfThreads) {
  Gaussians g;
  test::add_cube(g, kCenter, 0.4, 16);
  const VirtualCameraOptions options = {.placement = VirtualPlacement::Inside, .views = 12};
  const VirtualCameras first = virtual_cameras(g, options);
  test::for_thread_counts([&] {
    const VirtualCameras out = virtual_cameras(g, options);
    EXPECT_EQ(out.coverage, first.coverage);
    for (size_t i = 0; i < out.cameras.size(); ++i) {
      EXPECT_EQ(out.cameras[i].center(), first.cameras[i].center());
    }
  });
}

TEST(VirtualCameras, RefuseWhatMakesNoSense) {
  Gaussians g;
  EXPECT_THROW((void)virtual_cameras(g, {}), InvalidInput);
  test::add_sphere(g, kCenter, 0.3, 10);
  EXPECT_THROW((void)virtual_cameras(g, {.views = 3}), InvalidInput);
  EXPECT_THROW((void)virtual_cameras(g, {.size = 10}), InvalidInput);
}

}  // namespace
}  // namespace cgs::virtual_cameras_test
