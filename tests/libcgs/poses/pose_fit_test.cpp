// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/pose_fit.h"

#include <gtest/gtest.h>

#include "tests/support/unposed_photos.h"

namespace cgs::pose_fit_test {
namespace {

PosedPhoto posed(const test::PointScene& scene, size_t i) {
  return {"", scene.cameras[i], test::unposed_photo(scene, i).features};
}

// Two cameras side by side that look straight on: epipolar lines are rows.
test::PointScene side_by_side() {
  test::PointScene scene;
  for (const double x : {-0.4, 0.4}) {
    scene.cameras.push_back(test::looking_at({x, 0, -6}, {x, 0, 0}, 1200, 900, 900));
  }
  scene.points = test::scattered_points(400, {2, 1.5, 1.5});
  scene.noise = 1e-6;
  return scene;
}

TEST(EpipolarFits, AreExactForTrueCameras) {
  const test::PointScene scene = side_by_side();
  const auto fits = epipolar_fits({posed(scene, 0), posed(scene, 1)});
  ASSERT_EQ(fits.size(), 1u);
  EXPECT_EQ(fits[0].a, 0);
  EXPECT_EQ(fits[0].b, 1);
  EXPECT_GT(fits[0].matches, 200u);
  EXPECT_LT(fits[0].error, 1e-4);
}

TEST(EpipolarFits, TellByHowManyPixelsACameraIsOff) {
  const test::PointScene scene = side_by_side();
  PosedPhoto right = posed(scene, 1);
  for (const double off : {0.5, 3.0, 20.0}) {
    right.camera.cy = scene.cameras[1].cy + off;
    const auto fits = epipolar_fits({posed(scene, 0), right});
    ASSERT_EQ(fits.size(), 1u);
    EXPECT_NEAR(fits[0].error, off, 1e-3);
  }
}

TEST(EpipolarFits, AreInPixelsOfThePictureSearchedWhateverShapeTheyHave) {
  const test::PointScene scene = side_by_side();
  std::vector<PosedPhoto> photos = {posed(scene, 0), posed(scene, 1)};
  for (PosedPhoto& photo : photos) {  // the photographs are twice as large, and once more as high
    photo.features.pixel = 2;
    photo.camera = resized(photo.camera, 2400, 3600);
    for (Eigen::Vector2d& p : photo.features.points) p = {2 * p.x(), 4 * p.y()};
  }
  photos[1].camera.cy += 8;
  const auto fits = epipolar_fits(photos);
  ASSERT_EQ(fits.size(), 1u);
  // 8 of fy = 3600, shown with the focal length of both directions, in pixels of two.
  EXPECT_NEAR(fits[0].error, 8.0 / 3600 * std::sqrt(1800.0 * 3600) / 2, 1e-3);
}

// Nothing says how far what they show is away, but they cannot differ by more than their turn.
TEST(EpipolarFits, AreAnglesForCamerasAtOnePlace) {
  test::PointScene scene = side_by_side();
  scene.cameras[1].world_from_cam.translation() = scene.cameras[0].center();
  PosedPhoto right = posed(scene, 1);
  for (const double off : {0.0, 0.01}) {
    right.camera.world_from_cam.linear() =
        scene.cameras[1].world_from_cam.linear() *
        Eigen::AngleAxisd(off, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const auto fits = epipolar_fits({posed(scene, 0), right});
    ASSERT_EQ(fits.size(), 1u);
    EXPECT_NEAR(fits[0].error, 900 * off, 0.01 + 0.1 * 900 * off) << off;
  }
}

TEST(EpipolarFits, DoNotDependOnThePlace) {
  const test::PointScene scene = side_by_side();
  std::vector<PosedPhoto> photos = {posed(scene, 0), posed(scene, 1)};
  photos[1].camera.cy += 3;
  const double here = epipolar_fits(photos)[0].error;
  const Eigen::Vector3d far(512'345, 5'403'210, 287);
  for (PosedPhoto& photo : photos) photo.camera.world_from_cam.pretranslate(far);
  EXPECT_NEAR(epipolar_fits(photos)[0].error, here, 1e-5);
}

TEST(EpipolarFits, LeaveOutPairsThatShareTooLittle) {
  test::PointScene scene = side_by_side();
  scene.points.resize(15);
  EXPECT_TRUE(epipolar_fits({posed(scene, 0), posed(scene, 1)}).empty());
}

}  // namespace
}  // namespace cgs::pose_fit_test
