// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/two_view.h"

#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/unposed_photos.h"

namespace cgs::two_view_test {
namespace {

// Exact images of points in two cameras, from the image centres, and a share of wrong ones.
MatchedPoints matched(const std::vector<Eigen::Vector3d>& points,
                      const Camera& a,
                      const Camera& b,
                      double wrong = 0) {
  MatchedPoints out;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d centre(a.cx, a.cy);
    out.a.push_back(a.project(p).head<2>() - centre);
    out.b.push_back(b.project(p).head<2>() - centre);
    if (uniform(random) < 2 * wrong - 1)
      out.b.back() = {500 * uniform(random), 400 * uniform(random)};
  }
  return out;
}

const Camera kA = test::looking_at({-1, 0.2, -6}, {0, 0, 0}, 1200, 900, 900);
const Camera kB = test::looking_at({1, -0.3, -6.2}, {0.2, 0, 0}, 1200, 900, 900);

// Largest of the errors of rotation [rad] and direction.
double pose_error(const PhotoPose& pose) {
  const Eigen::Isometry3d truth = kB.cam_from_world() * kA.world_from_cam;
  return std::max(pose.rotation.angularDistance(Eigen::Quaterniond(truth.rotation())),
                  (pose.translation - truth.translation().normalized()).norm());
}

TEST(RelativePoses, StartWithThatOfTheCameras) {
  const auto points = test::scattered_points(200, {2, 1.5, 1.5});
  for (const double wrong : {0.0, 0.2}) {
    const auto poses = relative_poses(matched(points, kA, kB, wrong), 900, 900, 2);
    ASSERT_FALSE(poses.empty());
    EXPECT_LT(pose_error(poses[0]), 1e-5);
  }
}

// A plane seen from two places can be seen so from two others: both must be offered.
TEST(RelativePoses, OfAPlaneHoldTheTrueOne) {
  auto points = test::scattered_points(200, {2, 1.5, 1.5});
  for (Eigen::Vector3d& p : points) p.z() = 0.3 * p.x() - 0.1 * p.y();
  const auto poses = relative_poses(matched(points, kA, kB, 0), 900, 900, 2);
  double least = 1;
  double most = 0;
  for (const PhotoPose& pose : poses) {
    least = std::min(least, pose_error(pose));
    most = std::max(most, pose_error(pose));
  }
  EXPECT_LT(least, 1e-4);
  EXPECT_GT(most, 0.05);
}

TEST(RelativePoses, NeedMatches) { EXPECT_TRUE(relative_poses({}, 900, 900, 2).empty()); }

TEST(Parallax, IsWhatTurningDoesNotExplain) {
  const auto points = test::scattered_points(200, {2, 1.5, 1.5});
  Camera turned = kA;
  turned.world_from_cam.linear() =
      Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.1, 1, 0).normalized()) * kA.world_from_cam.linear();
  EXPECT_LT(parallax(matched(points, kA, turned), 900, 900), 1e-6);
  EXPECT_GT(parallax(matched(points, kA, kB), 900, 900), 20);
}

TEST(EpipolarInliers, AreThoseThatAreNotWrong) {
  const auto points = test::scattered_points(300, {2, 1.5, 1.5});
  const MatchedPoints right = matched(points, kA, kB);
  const MatchedPoints some_wrong = matched(points, kA, kB, 0.3);
  const std::vector<char> is_inlier = epipolar_inliers(some_wrong, 1);
  int wrong_kept = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (right.b[i] == some_wrong.b[i]) {
      EXPECT_EQ(is_inlier[i], 1) << i;
    } else {
      wrong_kept += is_inlier[i];
    }
  }
  EXPECT_LT(wrong_kept, 6);  // those that lie on their line by chance
}

TEST(HomographyInliers, AreThoseOnAPlane) {
  auto points = test::scattered_points(200, {2, 1.5, 1.5});
  for (size_t i = 0; i < 120; ++i) points[i].z() = 0.3 * points[i].x();
  const std::vector<char> is_inlier = homography_inliers(matched(points, kA, kB), 1);
  EXPECT_GE(std::accumulate(is_inlier.begin(), is_inlier.begin() + 120, 0), 119);
  EXPECT_LE(std::accumulate(is_inlier.begin() + 120, is_inlier.end(), 0), 8);
}

}  // namespace
}  // namespace cgs::two_view_test
