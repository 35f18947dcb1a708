// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/seen_surface.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace cgs::seen_surface_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kGap = 0.01f;

Camera camera_at(const Eigen::Vector3d& center) {
  Camera camera{.width = 80, .height = 60, .fx = 100, .fy = 100, .cx = 40, .cy = 30};
  camera.world_from_cam.translation() = center;
  return camera;
}

// Inverse depth of the plane n . X = 1 at a point of the picture of a camera that is only shifted.
double on_plane(const Eigen::Vector3d& n, const Camera& camera, double u, double v) {
  return n.dot(camera.ray_in_cam(u, v)) / (1 - n.dot(camera.center()));
}

DepthMap plane_depth(const Eigen::Vector3d& n, const Camera& camera) {
  DepthMap depth(camera.width, camera.height, kNan);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      depth(x, y) = static_cast<float>(1 / on_plane(n, camera, x + 0.5, y + 0.5));
    }
  }
  return depth;
}

// A near half on the left and a far one on the right.
DepthMap step_depth(const Camera& camera, float near, float far) {
  DepthMap depth(camera.width, camera.height, far);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width / 2; ++x) depth(x, y) = near;
  }
  return depth;
}

SeenSurface seen(const Camera& from, const DepthMap& depth, const Camera& to, float gap = kGap) {
  const DepthMap gaps(depth.width, depth.height, gap);
  return seen_surface({from, depth, surface_links(depth, gaps)}, to);
}

constexpr int kRight = 1;
constexpr int kBelow = 2;

TEST(SurfaceLinks, JoinNeighboursWithoutAGapOrOnASlope) {
  const Camera camera = camera_at({0, 0, 0});
  DepthMap depth = step_depth(camera, 1, 2);
  depth(60, 30) = kNan;
  const SurfaceLinks links = surface_links(depth, DepthMap(80, 60, kGap));
  EXPECT_EQ(links(10, 10), kRight + kBelow);
  EXPECT_EQ(links(39, 10), kBelow) << "the step";
  EXPECT_EQ(links(60, 30), 0) << "unknown";
  EXPECT_EQ(links(59, 30), kBelow);
  EXPECT_EQ(links(60, 29), kRight);
  EXPECT_EQ(links(79, 10), kBelow) << "the right edge";
  EXPECT_EQ(links(10, 59), kRight) << "the lower edge";
  // On the left, steps are twice the gap, and go on evenly.
  const DepthMap slope = plane_depth({1.2, 0, 1}, camera);
  const SurfaceLinks on_slope = surface_links(slope, DepthMap(80, 60, kGap));
  for (int x = 0; x < 79; ++x) EXPECT_EQ(on_slope(x, 30), kRight + kBelow) << x;
}

TEST(SeenSurface, IsTheDepthItselfFromTheSamePlace) {
  const Camera camera = camera_at({0, 0, 0});
  DepthMap depth = plane_depth({0.1, -0.2, 1}, camera);
  depth(7, 9) = kNan;
  const SeenSurface surface = seen(camera, depth, camera);
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (std::isnan(depth.data[i])) {
      EXPECT_EQ(surface.pixel.data[i], -1);
      EXPECT_TRUE(std::isnan(surface.depth.data[i]));
    } else {
      EXPECT_EQ(surface.pixel.data[i], static_cast<int>(i));
      EXPECT_NEAR(surface.depth.data[i], depth.data[i], 1e-5);
    }
  }
}

TEST(SeenSurface, StaysClosedAndExactOnSlantedPlanes) {
  const Camera camera = camera_at({0, 0, 0});
  const Camera novel = camera_at({0.02, 0.03, 0.45});
  for (const Eigen::Vector3d& n :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, 0, 1), Eigen::Vector3d(-0.4, 0.9, 1)}) {
    const SeenSurface surface = seen(camera, plane_depth(n, camera), novel);
    for (int y = 0; y < novel.height; ++y) {
      for (int x = 0; x < novel.width; ++x) {
        const double z = 1 / on_plane(n, novel, x + 0.5, y + 0.5);
        if (!camera.sees(camera.project(novel.unproject(x + 0.5, y + 0.5, z)))) continue;
        ASSERT_NEAR(surface.depth(x, y), z, 1e-4 * z) << x << ", " << y;
      }
    }
  }
}

TEST(SeenSurface, IsTornByAsMuchAsTheParallaxOfAStep) {
  const Camera camera = camera_at({0, 0, 0});
  const DepthMap depth = step_depth(camera, 1, 2);
  // 100 px * 0.2 * (1 - 1 / 2): the near half moves to the left by twice what the far half does.
  const SeenSurface surface = seen(camera, depth, camera_at({0.2, 0, 0}));
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 70; ++x) {
      const float expected = x < 20 ? 1 : x < 30 ? kNan : 2;
      if (std::isnan(expected)) {
        ASSERT_TRUE(std::isnan(surface.depth(x, y))) << x;
      } else {
        ASSERT_NEAR(surface.depth(x, y), expected, 1e-5) << x;
      }
    }
  }
}

TEST(SeenSurface, ShowsTheNearerOfTwoCells) {
  const Camera camera = camera_at({0, 0, 0});
  const SeenSurface surface = seen(camera, step_depth(camera, 1, 2), camera_at({-0.2, 0, 0}));
  EXPECT_NEAR(surface.depth(55, 30), 1, 1e-5);  // the far half begins at 50
  EXPECT_NEAR(surface.depth(61, 30), 2, 1e-5);
}

TEST(SeenSurface, IsNotTornByStepsBelowTheGap) {
  const Camera camera = camera_at({0, 0, 0});
  const DepthMap depth = step_depth(camera, 1, 1.1f);
  const Camera novel = camera_at({0.3, 0, 0});  // halves end at 10 and begin at 12.7
  EXPECT_TRUE(std::isnan(seen(camera, depth, novel, 0.05f).depth(11, 30)));
  EXPECT_FALSE(std::isnan(seen(camera, depth, novel, 0.12f).depth(11, 30)));
}

TEST(SeenSurface, HasNoBack) {
  const Camera front = camera_at({0, 0, 0});
  const DepthMap depth = plane_depth({0, 0, 0.5}, front);  // at z = 2
  Camera back = camera_at({0, 0, 4});
  back.world_from_cam.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  const SeenSurface surface = seen(front, depth, back);
  for (const int32_t pixel : surface.pixel.data) EXPECT_EQ(pixel, -1);
  for (const float z : surface.depth.data) EXPECT_TRUE(std::isnan(z));
}

// Corners of its cells are up to 1e11 pixels away, and those in the middle reach over a quarter of
// the picture.
TEST(SeenSurface, EndsWhereTheCameraAllButTouchesIt) {
  Camera camera = camera_at({0, 0, 0});
  camera.width = 160;
  camera.height = 120;
  camera.cx = 80;
  camera.cy = 60;
  Camera touching = camera;
  touching.world_from_cam.translation().z() = 1 - 1e-10;
  const SeenSurface surface = seen(camera, DepthMap(160, 120, 1), touching);
  for (const int32_t pixel : surface.pixel.data) ASSERT_EQ(pixel, -1);
}

// However long the lens that looks at it is.
TEST(SeenSurface, StaysClosedThroughALongLens) {
  const Camera camera = camera_at({0, 0, 0});
  Camera narrow = camera;
  narrow.fx *= 150;
  narrow.fy *= 150;
  const SeenSurface surface = seen(camera, DepthMap(80, 60, 1), narrow);
  for (size_t i = 0; i < surface.pixel.data.size(); ++i) {
    ASSERT_GE(surface.pixel.data[i], 0) << i;
    ASSERT_NEAR(surface.depth.data[i], 1, 1e-5) << i;
  }
}

TEST(SeenSurface, LeavesOutWhatLiesBehindTheCamera) {
  const Camera camera = camera_at({0, 0, 0});
  const SeenSurface surface = seen(camera, DepthMap(80, 60, 1), camera_at({0, 0, 2}));
  for (const int32_t pixel : surface.pixel.data) ASSERT_EQ(pixel, -1);
}

}  // namespace
}  // namespace cgs::seen_surface_test
