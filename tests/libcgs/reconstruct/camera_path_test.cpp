// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/camera_path.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/camera_row.h"

namespace cgs::camera_path_test {
namespace {

using test::row_of_cameras;

const Eigen::Vector3d kSubject(0, 0, 5);

double degrees_off(const Camera& camera, const Eigen::Vector3d& at) {
  const Eigen::Vector3d axis = camera.world_from_cam.linear().col(2);
  const double cosine = axis.dot((at - camera.center()).normalized());
  return std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
}

TEST(CameraPath, OrbitsOnceAroundTheSubjectUpright) {
  const auto path = camera_path(row_of_cameras(), "orbit", 8);
  ASSERT_EQ(path.size(), 8u);
  const double distance = (5 + 2 * std::hypot(5, 1)) / 3;  // the mean of the input views
  for (const Camera& camera : path) {
    EXPECT_NEAR((camera.center() - kSubject).norm(), distance, 1e-9);
    EXPECT_LT(degrees_off(camera, kSubject), 1e-4);
    EXPECT_NEAR(camera.world_from_cam.linear().col(1).y(), 1, 1e-9);  // +y of the picture is down
    EXPECT_NEAR(camera.world_from_cam.linear().determinant(), 1, 1e-9);
  }
  EXPECT_LT((path[4].center() - Eigen::Vector3d(0, 0, 5 + distance)).norm(), 1e-9);
}

// Whose mean lies inside of the subject.
TEST(CameraPath, KeepsItsDistanceFromASubjectWithViewsAllAround) {
  Model model = row_of_cameras();
  for (int i = 0; i < 3; ++i) {
    Camera& camera = model.scene.views[static_cast<size_t>(i)].camera;
    camera.world_from_cam =
        Eigen::Translation3d(kSubject) *
        Eigen::AngleAxisd(2 * std::numbers::pi * i / 3, Eigen::Vector3d::UnitY()) *
        Eigen::Translation3d(0, 0, -5);
  }
  for (const char* name : {"orbit", "spiral"}) {
    for (const Camera& camera : camera_path(model, name, 12)) {
      EXPECT_GT((camera.center() - kSubject).norm(), 3.5) << name;
      EXPECT_LT((camera.center() - kSubject).norm(), 7) << name;
      EXPECT_LT(degrees_off(camera, kSubject), 1e-4) << name;
    }
  }
}

TEST(CameraPath, SpiralIsAsWideAsTheCamerasAndLooksAtTheSubject) {
  const auto path = camera_path(row_of_cameras(), "spiral", 40);
  double widest = 0;
  double highest = 0;
  for (const Camera& camera : path) {
    EXPECT_LT(degrees_off(camera, kSubject), 1e-4);
    widest = std::max(widest, std::abs(camera.center().x()));
    highest = std::max(highest, std::abs(camera.center().y()));
  }
  EXPECT_NEAR(widest, 1, 1e-6);
  EXPECT_NEAR(highest, 0.3, 1e-3);
  EXPECT_LT((path.back().center() - path.front().center()).norm(), 0.4);  // it closes
}

TEST(CameraPath, BetweenVisitsEveryInputViewAndComesBack) {
  const Model model = row_of_cameras();
  const auto path = camera_path(model, "between", 4);
  EXPECT_LT((path[0].center() - model.scene.views[0].camera.center()).norm(), 1e-9);
  EXPECT_LT((path[1].center() - model.scene.views[1].camera.center()).norm(), 1e-9);
  EXPECT_LT((path[2].center() - model.scene.views[2].camera.center()).norm(), 1e-9);
  EXPECT_LT((path[3].center() - path[1].center()).norm(), 1e-9);
}

TEST(CameraPath, RefusesWhatLeadsNowhere) {
  EXPECT_THROW(camera_path(row_of_cameras(), "loop", 8), InvalidInput);
  EXPECT_THROW(camera_path(row_of_cameras(), "orbit", 1), InvalidInput);
  EXPECT_THROW(camera_path(row_of_cameras(), "orbit", 1'000'000'000), InvalidInput);
  EXPECT_THROW(camera_path({}, "orbit", 8), InvalidInput);
  Model blind = row_of_cameras();
  for (ViewPriors& priors : blind.priors) priors.depth = DepthMap(40, 30, std::nanf(""));
  EXPECT_THROW(camera_path(blind, "spiral", 8), NumericalError);
}

}  // namespace
}  // namespace cgs::camera_path_test
