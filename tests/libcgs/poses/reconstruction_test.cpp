// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/reconstruction.h"

#include <gtest/gtest.h>

namespace cgs::reconstruction_test {
namespace {

// Two cameras side by side, and a third that is not placed.
Reconstruction two_of_three() {
  Reconstruction scene;
  scene.lenses = {{800, 0.05, {3, -2}}};
  scene.lens_of = {0, 0, 0};
  scene.poses = {PhotoPose{}, PhotoPose{Eigen::Quaterniond::Identity(), {-1, 0, 0}}, std::nullopt};
  return scene;
}

Observation observation(const Reconstruction& scene, int photo, const Eigen::Vector3d& point) {
  const Lens lens = scene.lens(photo);
  const Eigen::Vector2d direction = (*scene.pose(photo) * point).hnormalized();
  return {photo, 0, through_lens(lens.focal, lens.k1, lens.centre, direction), true};
}

TEST(Lens, ShowsADirectionWhereItIsLookedUp) {
  for (const double k1 : {-0.1, 0.0, 0.08}) {
    const Lens lens{700, k1, {5, 9}};
    for (const Eigen::Vector2d& direction : {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.6, -0.4)}) {
      const Eigen::Vector2d at = through_lens(lens.focal, lens.k1, lens.centre, direction);
      EXPECT_LT((direction_at(lens, at) - direction).norm(), 1e-9) << k1;
    }
  }
}

TEST(Triangulate, FindsPointsAndTellsWrongObservations) {
  Reconstruction scene = two_of_three();
  const Eigen::Vector3d truth(0.4, -0.3, 5);
  Track good;
  good.seen = {observation(scene, 0, truth), observation(scene, 1, truth), {2, 0, {0, 0}, true}};
  Track wrong = good;
  wrong.seen[1].at.y() += 50;
  Track far = good;
  far.seen = {observation(scene, 0, {10, 0, 5000}), observation(scene, 1, {10, 0, 5000})};
  scene.tracks = {good, wrong, far};
  triangulate(scene, 2, 0.01);
  ASSERT_TRUE(scene.tracks[0].is_known);
  EXPECT_LT((scene.tracks[0].position - truth).norm(), 1e-9);
  EXPECT_TRUE(scene.tracks[0].seen[2].is_used);  // not placed: nothing is known against it
  EXPECT_FALSE(scene.tracks[1].is_known);
  EXPECT_FALSE(scene.tracks[2].is_known);  // 0.0002 rad
  EXPECT_NEAR(ray_angle(scene, scene.tracks[2]), 1.0 / 5000, 1e-6);
}

TEST(Triangulate, LeavesOutTheOneWrongObservationOfThree) {
  Reconstruction scene = two_of_three();
  scene.poses[2] = PhotoPose{Eigen::Quaterniond::Identity(), {-3, 0, 0}};
  const Eigen::Vector3d truth(0.4, -0.3, 5);
  for (const size_t wrong : {0u, 1u, 2u}) {
    Track track;
    for (const int photo : {0, 1, 2}) track.seen.push_back(observation(scene, photo, truth));
    track.seen[wrong].at.y() += 50;
    scene.tracks = {track};
    triangulate(scene, 2, 0.01);
    ASSERT_TRUE(scene.tracks[0].is_known) << wrong;
    EXPECT_LT((scene.tracks[0].position - truth).norm(), 1e-9) << wrong;
    for (const size_t i : {0u, 1u, 2u}) EXPECT_EQ(scene.tracks[0].seen[i].is_used, i != wrong);
  }
}

TEST(DropOutliers, ForgetsPointsThatOnePhotographVouchesFor) {
  Reconstruction scene = two_of_three();
  const Eigen::Vector3d truth(0.4, -0.3, 5);
  Track track;
  track.seen = {observation(scene, 0, truth), observation(scene, 1, truth)};
  scene.tracks = {track};
  triangulate(scene, 2, 0.01);
  drop_outliers(scene, 2, 0.01);
  EXPECT_TRUE(scene.tracks[0].is_known);
  scene.tracks[0].seen[1].at.x() += 10;
  drop_outliers(scene, 2, 0.01);
  EXPECT_FALSE(scene.tracks[0].is_known);
}

TEST(ReprojectionError, IsInfiniteBehindTheCamera) {
  const Reconstruction scene = two_of_three();
  EXPECT_TRUE(std::isinf(reprojection_error(scene, {0, 0, -1}, {0, 0, {0, 0}, true})));
}

}  // namespace
}  // namespace cgs::reconstruction_test
