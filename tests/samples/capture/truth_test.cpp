// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/truth.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "samples/capture/solids.h"

namespace cgs::truth_test {
namespace {

using Eigen::Vector3d;

// Looks along +y from `eye`, z up.
Camera front_camera(const Vector3d& eye) {
  Camera camera{.width = 64, .height = 48, .fx = 60, .fy = 60, .cx = 32, .cy = 24};
  camera.world_from_cam.linear() << Vector3d::UnitX(), -Vector3d::UnitZ(), Vector3d::UnitY();
  camera.world_from_cam.translation() = eye;
  return camera;
}

PortalScene scene_of(const std::vector<TriangleMesh>& solids) {
  PortalScene scene;
  for (const auto& solid : solids) add_part(scene, "solid", Material::Ashlar, solid);
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

TEST(ExactDepth, IsTheDistanceOfABoxAndItsTop) {
  const PortalScene scene = scene_of({box({-50, 4, -50}, {50, 6, 0})});
  const Camera camera = front_camera({0, 0, 1});
  const DepthMap depth = exact_depth(scene, camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double down = camera.ray_in_cam(x + 0.5, y + 0.5).y();
      // The upper edge lies 1 below the eye at depth 4: its top is seen above that, not its front.
      if (down < 1.0 / 6) {
        EXPECT_TRUE(std::isnan(depth(x, y)));
      } else {
        EXPECT_NEAR(depth(x, y), down < 0.25 ? 1 / down : 4.0, 1e-6);
      }
    }
  }
}

TEST(ExactDepth, IsTheDistanceOfACylinder) {
  constexpr int kSides = 720;
  PortalScene scene;
  add_part(scene,
           "cylinder",
           Material::Ashlar,
           moved(lathed({.profile = {{1, -9}, {1, 9}}, .sides = kSides}),
                 Eigen::Isometry3d(Eigen::Translation3d(0.3, 5, 0))));
  scene.bvh = build_bvh(scene.mesh);
  const Camera camera = front_camera({0, 0, 0});
  const ViewTruth truth = view_truth(scene, camera, {});
  int compared = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      // Nearer root of |s (u, 1) - (0.3, 5)| = 1.
      const double u = camera.ray_in_cam(x + 0.5, y + 0.5).x();
      const double a = u * u + 1;
      const double b = 0.3 * u + 5;
      const double root = b * b - a * (0.09 + 25 - 1);
      if (root < 0.05) continue;
      const double s = (b - std::sqrt(root)) / a;
      ++compared;
      // The prism lies inside the circle by 1 - cos(pi / sides) = 1e-5.
      EXPECT_NEAR(truth.depth(x, y), s, 2e-4);
      const Vector3d normal(s * u - 0.3, s - 5, 0);
      EXPECT_NEAR((truth.normal(x, y).cast<double>() - normal).norm(), 0, 0.01);
    }
  }
  EXPECT_GT(compared, 500);
}

TEST(SeenBy, CountsCamerasThatAnOccluderLeaves) {
  const PortalScene scene =
      scene_of({box({-9, 5, -9}, {9, 6, 9}), box({-0.5, 2, -1}, {0.5, 3, 1})});
  const std::vector<Camera> cameras{
      front_camera({-1, 0, 0}), front_camera({0, 0, 0}), front_camera({1, 0, 0})};
  EXPECT_EQ(seen_by(scene.bvh, {0, 5, 0}, cameras), 0);     // behind it for all
  EXPECT_EQ(seen_by(scene.bvh, {0, 2, 0}, cameras), 3);     // on its front
  EXPECT_EQ(seen_by(scene.bvh, {0, 3, 0}, cameras), 0);     // on its back
  EXPECT_EQ(seen_by(scene.bvh, {1.6, 5, 0}, cameras), 2);   // hidden from the left one
  EXPECT_EQ(seen_by(scene.bvh, {-1.6, 5, 0}, cameras), 2);  // hidden from the right one
  EXPECT_EQ(seen_by(scene.bvh, {0, 5, 8}, cameras), 0);     // above all pictures
}

TEST(ViewTruth, VisibilityMirrorsWithTheScene) {
  const PortalScene scene =
      scene_of({box({-9, 5, -9}, {9, 6, 9}), box({-0.5, 2, -1}, {0.5, 3, 1})});
  const std::vector<Camera> cameras{front_camera({-1, 0, 0}), front_camera({1, 0, 0})};
  const ViewTruth left = view_truth(scene, cameras[0], cameras);
  const ViewTruth right = view_truth(scene, cameras[1], cameras);
  const int w = left.seen.width;
  std::array<int, 3> counts = {};
  for (int y = 0; y < left.seen.height; ++y) {
    for (int x = 0; x < w; ++x) {
      EXPECT_EQ(left.seen(x, y), right.seen(w - 1 - x, y));
      ASSERT_LE(left.seen(x, y), 2);
      ++counts.at(left.seen(x, y));
    }
  }
  EXPECT_EQ(counts[0], 0);  // an input sees what it shows
  EXPECT_GT(counts[1], 100);
  EXPECT_GT(counts[2], 100);
}

TEST(CaptureViews, HaveBaselinesFitForStereo) {
  const auto inputs = input_cameras(capture_views());
  ASSERT_EQ(inputs.size(), 3U);
  for (size_t i = 0; i + 1 < inputs.size(); ++i) {
    const double baseline = (inputs[i].center() - inputs[i + 1].center()).norm();
    const double depth = std::abs(inputs[i].center().y());
    EXPECT_GE(baseline / depth, 0.10);
    EXPECT_LE(baseline / depth, 0.18);
  }
}

TEST(CaptureViews, LookStraight) {
  for (const auto& view : capture_views(2)) {
    const Eigen::Matrix3d R = view.camera.world_from_cam.linear();
    EXPECT_NEAR((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
    EXPECT_NEAR(R.determinant(), 1, 1e-12);
    EXPECT_NEAR(R(2, 0), 0, 1e-12);  // no roll
    EXPECT_LT(R(2, 1), 0);           // image rows run down
    EXPECT_EQ(view.camera.width, 252);
  }
}

TEST(CaptureViews, RefuseASizeThatDoesNotDivide) {
  EXPECT_THROW(capture_views(0), InvalidInput);
  EXPECT_THROW(capture_views(5), InvalidInput);
}

TEST(ViewTruth, CoversEveryPixelOfTheCaptureAndShowsHolesOutsideTheInputs) {
  const PortalScene scene = portal_scene();
  const auto views = capture_views(3);
  const auto inputs = input_cameras(views);
  for (const auto& view : views) {
    const ViewTruth truth = view_truth(scene, view.camera, inputs);
    int holes = 0;
    for (size_t i = 0; i < truth.depth.data.size(); ++i) {
      ASSERT_TRUE(std::isfinite(truth.depth.data[i])) << view.name;
      ASSERT_GT(truth.depth.data[i], 1) << view.name;
      holes += truth.seen.data[i] == 0 ? 1 : 0;
    }
    const double fraction = holes / static_cast<double>(truth.depth.data.size());
    if (view.input) {
      EXPECT_EQ(holes, 0) << view.name;
    } else if (view.name >= "view_06") {
      EXPECT_GT(fraction, 0.05) << view.name;
      EXPECT_LT(fraction, 0.25) << view.name;
    }
  }
}

}  // namespace
}  // namespace cgs::truth_test
