// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/refine_poses.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/unposed_photos.h"

namespace cgs::refine_poses_test {
namespace {

using test::PointScene;
using test::pose_errors;

Camera camera_at(double x, double y, double z) {
  return test::looking_at({x, y, z}, {0.1 * x, 0.05, 0}, 1200, 900, 900);
}

// Four cameras before a box full of points; the last is farthest from the first.
PointScene four_views() {
  PointScene scene;
  scene.cameras = {camera_at(-1.5, 0.2, -6),
                   camera_at(0.1, -0.4, -6.5),
                   camera_at(0.4, 0.9, -6.1),
                   camera_at(1.6, 0.3, -5.8)};
  scene.points = test::scattered_points(500, {2.5, 1.8, 1.5});
  return scene;
}

// The same camera, turned by some degrees and moved by a share of 3 units, each in a direction of
// its own.
Camera disturbed(Camera camera, double degrees, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    const double x = normal(random);
    const double y = normal(random);
    const double z = normal(random);
    return Eigen::Vector3d(x, y, z).normalized();
  };
  const Eigen::AngleAxisd turn(degrees * M_PI / 180, direction());
  camera.world_from_cam.linear() = turn * camera.world_from_cam.linear();
  camera.world_from_cam.translation() += 3 * share * direction();
  return camera;
}

std::vector<PosedPhoto> posed_photos(const PointScene& scene, double degrees, double share) {
  std::vector<PosedPhoto> out;
  for (size_t i = 0; i < scene.cameras.size(); ++i) {
    out.push_back({"photo_" + std::to_string(i),
                   disturbed(scene.cameras[i], degrees, share, unsigned(i) + 1),
                   test::unposed_photo(scene, i).features});
  }
  return out;
}

std::vector<Camera> cameras_of(const PointScene& scene, const PoseRefinement& refined) {
  std::vector<Camera> out = scene.cameras;
  for (size_t i = 0; i < out.size(); ++i) out[i].world_from_cam = refined.photos[i].world_from_cam;
  return out;
}

double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

TEST(RefinePoses, PutsDisturbedCamerasRight) {
  const PointScene scene = four_views();
  for (const auto& [degrees, share] :
       {std::pair(0.1, 0.002), {0.3, 0.005}, {0.5, 0.01}, {2, 0.05}}) {
    const std::vector<PosedPhoto> photos = posed_photos(scene, degrees, share);
    const PoseRefinement refined = refine_poses(photos);
    const auto errors = pose_errors(cameras_of(scene, refined), scene.cameras);
    EXPECT_LT(errors.rotation, 0.02) << degrees;
    EXPECT_LT(errors.direction, 0.1) << degrees;
    for (size_t i = 1; i < photos.size(); ++i) {
      EXPECT_TRUE(refined.photos[i].is_refined);
      EXPECT_GT(refined.photos[i].points, 300);
      EXPECT_GE(refined.photos[i].matches, refined.photos[i].points);
      EXPECT_LT(refined.photos[i].error_after, 0.5);
      EXPECT_GT(refined.photos[i].error_before, 2 * refined.photos[i].error_after);
    }
  }
}

TEST(RefinePoses, HoldsTheFirstCameraAndTheScale) {
  const std::vector<PosedPhoto> photos = posed_photos(four_views(), 0.5, 0.01);
  const PoseRefinement refined = refine_poses(photos);
  const auto& first = photos[0].camera.world_from_cam;
  EXPECT_FALSE(refined.photos[0].is_refined);
  EXPECT_EQ(refined.photos[0].world_from_cam.matrix(), first.matrix());
  EXPECT_NEAR(distance(refined.photos[3].world_from_cam, refined.photos[0].world_from_cam),
              distance(photos[3].camera.world_from_cam, first),
              1e-9);
}

TEST(RefinePoses, LeavesCamerasThatFit) {
  const std::vector<PosedPhoto> photos = posed_photos(four_views(), 0, 0);
  const PoseRefinement refined = refine_poses(photos);
  for (size_t i = 0; i < photos.size(); ++i) {
    EXPECT_FALSE(refined.photos[i].is_refined);
    EXPECT_GT(refined.photos[i].points, 300);
    EXPECT_EQ(refined.photos[i].world_from_cam.matrix(), photos[i].camera.world_from_cam.matrix());
  }
}

TEST(RefinePoses, StandsWrongMatches) {
  PointScene scene = four_views();
  scene.outliers = 0.3;
  const PoseRefinement refined = refine_poses(posed_photos(scene, 0.5, 0.01));
  const auto errors = pose_errors(cameras_of(scene, refined), scene.cameras);
  EXPECT_LT(errors.rotation, 0.04);
  EXPECT_LT(errors.direction, 0.2);
}

TEST(RefinePoses, TakesFocalLengthsThatDifferByDirectionAndPlaceOfTheCentre) {
  PointScene scene = four_views();
  for (Camera& camera : scene.cameras) {
    camera.fy *= 1.1;
    camera.cx += 30;
  }
  const PoseRefinement refined = refine_poses(posed_photos(scene, 0.5, 0.01));
  EXPECT_LT(pose_errors(cameras_of(scene, refined), scene.cameras).rotation, 0.02);
}

TEST(RefinePoses, LeavesPhotographsThatShareTooLittle) {
  PointScene scene = four_views();
  scene.points.resize(20);
  const std::vector<PosedPhoto> photos = posed_photos(scene, 0.5, 0.01);
  for (const RefinedPose& pose : refine_poses(photos).photos) {
    EXPECT_FALSE(pose.is_refined);
    EXPECT_EQ(pose.matches, 0);
    EXPECT_EQ(pose.points, 0);
  }
}

TEST(RefinePoses, LeavesAPhotographThatShowsSomethingElse) {
  std::vector<PosedPhoto> photos = posed_photos(four_views(), 0.5, 0.01);
  photos[3].features.points.resize(12);
  photos[3].features.descriptors.conservativeResize(12, Eigen::NoChange);
  const PoseRefinement refined = refine_poses(photos);
  EXPECT_TRUE(refined.photos[1].is_refined);
  EXPECT_EQ(refined.photos[3].points, 0);
  EXPECT_EQ(refined.photos[3].world_from_cam.matrix(), photos[3].camera.world_from_cam.matrix());
  // The farthest of those that are left gives the scale.
  EXPECT_NEAR(distance(refined.photos[2].world_from_cam, refined.photos[0].world_from_cam),
              distance(photos[2].camera.world_from_cam, photos[0].camera.world_from_cam),
              1e-9);
}

TEST(RefinePoses, GivesTheSameBitsInOtherUnitsAndTheSamePosesElsewhere) {
  const std::vector<PosedPhoto> photos = posed_photos(four_views(), 0.5, 0.01);
  const PoseRefinement here = refine_poses(photos);
  std::vector<PosedPhoto> larger = photos;
  for (PosedPhoto& photo : larger) photo.camera.world_from_cam.translation() *= 1024;
  std::vector<PosedPhoto> far = photos;
  const Eigen::Vector3d place(512'345, 5'403'210, 287);
  for (PosedPhoto& photo : far) photo.camera.world_from_cam.pretranslate(place);
  const PoseRefinement in_larger = refine_poses(larger);
  const PoseRefinement there = refine_poses(far);
  for (size_t i = 0; i < photos.size(); ++i) {
    const Eigen::Isometry3d& pose = here.photos[i].world_from_cam;
    EXPECT_EQ(in_larger.photos[i].world_from_cam.linear(), pose.linear());
    EXPECT_EQ(in_larger.photos[i].world_from_cam.translation(), 1024 * pose.translation());
    EXPECT_LT((there.photos[i].world_from_cam.translation() - place - pose.translation()).norm(),
              1e-6);
  }
}

TEST(RefinePoses, GivesTheSameBitsForAnyNumberOfThreads) {
  const std::vector<PosedPhoto> photos = posed_photos(four_views(), 0.5, 0.01);
  const PosedPhoto further = photos.back();
  const std::vector<PosedPhoto> first(photos.begin(), photos.end() - 1);
  std::vector<Eigen::Matrix4d> poses;
  for (const size_t threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const PoseRefinement refined = refine_poses(first);
    poses.push_back(refined.photos[1].world_from_cam.matrix());
    poses.push_back(refine_pose(further, refined.points).world_from_cam.matrix());
  }
  EXPECT_EQ(poses[0], poses[2]);
  EXPECT_EQ(poses[1], poses[3]);
}

TEST(RefinePose, PutsAFurtherCameraWhereTheRefinedOnesHaveIt) {
  const PointScene scene = four_views();
  std::vector<PosedPhoto> photos = posed_photos(scene, 0.5, 0.01);
  const PosedPhoto further = photos[1];
  photos.erase(photos.begin() + 1);
  const PoseRefinement refined = refine_poses(photos);
  const RefinedPose pose = refine_pose(further, refined.points);
  EXPECT_TRUE(pose.is_refined);
  EXPECT_GT(pose.points, 300);
  EXPECT_LT(pose.error_after, 0.5);
  std::vector<Camera> solved = {scene.cameras[0], scene.cameras[1]};
  solved[0].world_from_cam = refined.photos[0].world_from_cam;
  solved[1].world_from_cam = pose.world_from_cam;
  const auto errors = pose_errors(solved, {scene.cameras[0], scene.cameras[1]});
  EXPECT_LT(errors.rotation, 0.02);
  EXPECT_LT(errors.direction, 0.1);
}

// The error of a camera that is a little off need not halve.
TEST(RefinePose, FollowsThePointsWhereTheseMoved) {
  const PointScene scene = four_views();
  std::vector<PosedPhoto> photos = posed_photos(scene, 0.5, 0.01);
  PosedPhoto further = photos[1];
  photos.erase(photos.begin() + 1);
  PoseRefinement refined = refine_poses(photos);
  EXPECT_TRUE(refined.points.is_moved);
  further.camera.world_from_cam = refine_pose(further, refined.points).world_from_cam;
  further.camera = disturbed(further.camera, 0.01, 0, 4);
  const RefinedPose pose = refine_pose(further, refined.points);
  EXPECT_TRUE(pose.is_refined);
  EXPECT_GT(pose.error_after, 0.5 * pose.error_before);
  EXPECT_LT(pose.error_after, pose.error_before);
  refined.points.is_moved = false;
  EXPECT_FALSE(refine_pose(further, refined.points).is_refined);
}

TEST(RefinePose, LeavesACameraThatFitsOrSharesTooLittle) {
  std::vector<PosedPhoto> photos = posed_photos(four_views(), 0, 0);
  PosedPhoto further = photos[1];
  photos.erase(photos.begin() + 1);
  const PoseRefinement refined = refine_poses(photos);
  EXPECT_FALSE(refine_pose(further, refined.points).is_refined);
  EXPECT_GT(refine_pose(further, refined.points).points, 300);
  further.features.points.resize(12);
  further.features.descriptors.conservativeResize(12, Eigen::NoChange);
  const RefinedPose pose = refine_pose(further, refined.points);
  EXPECT_FALSE(pose.is_refined);
  EXPECT_EQ(pose.points, 0);
  EXPECT_EQ(pose.world_from_cam.matrix(), further.camera.world_from_cam.matrix());
}

}  // namespace
}  // namespace cgs::refine_poses_test
