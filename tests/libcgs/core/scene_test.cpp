// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/scene.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::scene_test {
namespace {

// Three cameras on a line, turned towards (0, 0, 4).
Scene converging_scene() {
  Scene scene;
  scene.folder = "scene";
  for (int i = 0; i < 3; ++i) {
    View view;
    view.name = std::to_string(i);
    view.camera = {.width = 64, .height = 48, .fx = 60, .fy = 60, .cx = 32, .cy = 24};
    const Eigen::Vector3d center(i - 1.0, 0, 0);
    const Eigen::Vector3d z = (Eigen::Vector3d(0, 0, 4) - center).normalized();
    const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
    view.camera.world_from_cam.linear() << x, z.cross(x), z;
    view.camera.world_from_cam.translation() = center;
    scene.views.push_back(view);
    scene.input.push_back(i);
  }
  return scene;
}

TEST(SceneKind, IsToldByItsName) {
  for (int i = 0; i <= static_cast<int>(SceneKind::Photographs); ++i) {
    const auto kind = static_cast<SceneKind>(i);
    const SceneKind told = scene_kind_of(scene_kind_name(kind));
    if (kind != SceneKind::ForeignCameras) EXPECT_EQ(told, kind) << i;
  }
  EXPECT_EQ(scene_kind_name(SceneKind::Llff), "LLFF");
  EXPECT_EQ(scene_kind_name(SceneKind::Photographs), "photographs");
  // What was read of a file that states a frame is not foreign, whatever it was made from.
  EXPECT_EQ(scene_kind_of(scene_kind_name(SceneKind::ForeignCameras)), SceneKind::CamerasJson);
  EXPECT_EQ(scene_kind_of("of a version to come"), SceneKind::Unknown);
}

TEST(DepthRange, TakesTheViewsOwnBoundsFirst) {
  Scene scene = converging_scene();
  scene.views[1].near = 1.5;
  scene.views[1].far = 9;
  EXPECT_EQ(depth_range(scene, 1).near, 1.5);
  EXPECT_EQ(depth_range(scene, 1).far, 9);
}

TEST(DepthRange, HoldsTheSparsePoints) {
  Scene scene = converging_scene();
  for (int i = 0; i < 30; ++i) {
    scene.points.push_back({.position = Eigen::Vector3d(0.01 * i, 0, 3 + 0.1 * i), .views = {}});
  }
  const DepthRange range = depth_range(scene, 1);
  EXPECT_LT(range.near, 3.0);
  EXPECT_GT(range.far, 5.9);
}

TEST(DepthRange, FallsBackToWhereTheAxesMeet) {
  const DepthRange range = depth_range(converging_scene(), 1);
  EXPECT_LT(range.near, 4);
  EXPECT_GT(range.far, 4);
}

TEST(DepthRange, RefusesOneCommonCentre) {
  Scene scene = converging_scene();
  for (View& view : scene.views) view.camera.world_from_cam.translation().setZero();
  EXPECT_THROW(depth_range(scene, 0), BadInput);
}

TEST(ToCanonical, KeepsProjectionsUnitAndUp) {
  Scene scene = converging_scene();
  const Eigen::Vector3d point(0.3, -0.2, 3.7);
  const Eigen::Vector3d before = scene.views[0].camera.project(point);
  scene.frame.up = Eigen::Vector3d(0.6, 0, 0.8);
  scene.frame.metres_per_unit = 0.5;
  to_canonical(scene);
  EXPECT_EQ(scene.frame.up, Eigen::Vector3d(0.6, 0, 0.8));
  EXPECT_EQ(scene.frame.metres_per_unit, 0.5);
  const Eigen::Vector3d after =
      scene.views[0].camera.project(scene.frame.internal_from_world(point));
  EXPECT_NEAR(before.x(), after.x(), 1e-9);
  EXPECT_NEAR(before.y(), after.y(), 1e-9);
  EXPECT_NEAR(before.z(), after.z() * scene.frame.scale, 1e-12);
}

TEST(ToCanonical, OfAFarSceneGivesTheSameBits) {
  Scene near = converging_scene();
  for (View& view : near.views) {  // few bits, so that moving by whole numbers rounds nothing
    Eigen::Vector3d t = view.camera.center();
    view.camera.world_from_cam.translation() = (t * 1024).array().round() / 1024;
  }
  Scene far = near;
  const Eigen::Vector3d ecef(-2.49e6, -4.68e6, 3.53e6);
  for (View& view : far.views) view.camera.world_from_cam.translation() += ecef;
  const DepthRange range = depth_range(near, 0);
  EXPECT_EQ(depth_range(far, 0).near, range.near);
  EXPECT_EQ(depth_range(far, 0).far, range.far);
  to_canonical(near);
  to_canonical(far);
  EXPECT_EQ(near.frame.scale, far.frame.scale);
  EXPECT_EQ(near.frame.origin + ecef, far.frame.origin);
  for (size_t i = 0; i < near.views.size(); ++i) {
    EXPECT_EQ(near.views[i].camera.world_from_cam.matrix(),
              far.views[i].camera.world_from_cam.matrix());
  }
}

}  // namespace
}  // namespace cgs::scene_test
