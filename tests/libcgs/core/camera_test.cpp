// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/camera.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace cgs::camera_test {
namespace {

Camera tilted_camera() {
  Camera camera{.width = 64, .height = 48, .fx = 50, .fy = 55, .cx = 30, .cy = 25};
  camera.world_from_cam.linear() =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  camera.world_from_cam.translation() = Eigen::Vector3d(1, -2, 0.5);
  return camera;
}

TEST(Camera, ProjectUndoesUnproject) {
  const Camera camera = tilted_camera();
  const Eigen::Vector3d uvz = camera.project(camera.unproject(12.25, 40.5, 3.0));
  EXPECT_NEAR(uvz.x(), 12.25, 1e-12);
  EXPECT_NEAR(uvz.y(), 40.5, 1e-12);
  EXPECT_NEAR(uvz.z(), 3.0, 1e-12);
}

TEST(Camera, ResizedProjectsToTheSamePlaceInThePicture) {
  const Camera camera = tilted_camera();
  const Camera half = resized(camera, 32, 24);
  const Eigen::Vector3d point = camera.unproject(20, 10, 4);
  EXPECT_NEAR(half.project(point).x(), 10, 1e-12);
  EXPECT_NEAR(half.project(point).y(), 5, 1e-12);
}

TEST(Camera, ResizedToFitHasTheLongerSideThatIsAskedForOrStays) {
  const Camera camera = tilted_camera();  // 64 x 48
  const Camera small = resized_to_fit(camera, 16);
  EXPECT_EQ(small.width, 16);
  EXPECT_EQ(small.height, 12);
  EXPECT_NEAR(small.project(camera.unproject(20, 10, 4)).x(), 5, 1e-12);
  const Camera sliver = resized_to_fit(resized(camera, 1, 400), 100);
  EXPECT_EQ(sliver.width, 1) << "never nothing";
  EXPECT_EQ(sliver.height, 100);
  EXPECT_EQ(resized_to_fit(camera, 64).fx, camera.fx);
  EXPECT_EQ(resized_to_fit(camera, 200).width, camera.width);
}

// Depth along the rays of a plane n.p = d.
DepthMap plane_depth(const Camera& camera, const Eigen::Vector3d& n, double d) {
  DepthMap depth(camera.width, camera.height, 0.0f);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      const Eigen::Vector3d ray =
          camera.world_from_cam.rotation() * camera.ray_in_cam(x + 0.5, y + 0.5);
      depth(x, y) = static_cast<float>((d - n.dot(camera.center())) / n.dot(ray));
    }
  }
  return depth;
}

TEST(NormalsFromDepth, AreExactOnAPlaneAndFaceTheCamera) {
  const Camera camera = tilted_camera();
  const Eigen::Vector3d axis = camera.world_from_cam.rotation().col(2);
  const Eigen::Vector3d n = (-axis + Eigen::Vector3d(0.2, 0.1, -0.1)).normalized();
  const NormalMap normals =
      normals_from_depth(plane_depth(camera, n, n.dot(camera.center() + 5 * axis)), camera);
  for (const Eigen::Vector3f& normal : normals.data) {
    EXPECT_NEAR(normal.cast<double>().dot(n), 1, 1e-4);
  }
}

TEST(NormalsFromDepth, StayOnTheirSurfaceAtAnOcclusionEdge) {
  Camera camera = tilted_camera();
  camera.world_from_cam = Eigen::Isometry3d::Identity();
  DepthMap depth(camera.width, camera.height, 2.0f);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 32; x < depth.width; ++x) depth(x, y) = 5.0f;
  }
  const NormalMap normals = normals_from_depth(depth, camera);
  for (const Eigen::Vector3f& normal : normals.data) EXPECT_NEAR(normal.z(), -1, 1e-5);
}

TEST(NormalsFromDepth, AreZeroWhereDepthIsUnknown) {
  Camera camera = tilted_camera();
  DepthMap depth(camera.width, camera.height, 2.0f);
  depth(10, 10) = std::numeric_limits<float>::quiet_NaN();
  const NormalMap normals = normals_from_depth(depth, camera);
  EXPECT_EQ(normals(10, 10).norm(), 0);
  EXPECT_NEAR(normals(11, 10).norm(), 1, 1e-5);
}

}  // namespace
}  // namespace cgs::camera_test
