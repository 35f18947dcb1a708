// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/front_plane.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/pane_scene.h"

namespace cgs::front_plane_test {
namespace {

using Eigen::Vector3d;
using Plane = Eigen::Hyperplane<double, 3>;

TEST(DepthOn, IsWhereTheRayMeetsThePlane) {
  const Camera camera = test::looking_at({0.3, -0.2, 0}, {0, 0, 5}, 40, 30, 50);
  const Plane plane(Vector3d(0.2, 0.1, -1).normalized(), Vector3d(0, 0, 3));
  const double z = depth_on(plane, camera, 31.5, 4.5);
  EXPECT_LT(plane.absDistance(camera.unproject(31.5, 4.5, z)), 1e-12);
  const Plane behind(Vector3d::UnitZ(), Vector3d(0, 0, -3));
  EXPECT_TRUE(std::isnan(depth_on(behind, camera, 20, 15)));
  const Plane along(camera.world_from_cam.linear().col(0), camera.center());
  EXPECT_TRUE(std::isnan(depth_on(along, camera, camera.cx, camera.cy)));
}

// What is left of the photographs is what the pane shows in front of grey.
TEST(FindFrontPlane, FindsItWhereViewsAgree) {
  std::vector<Camera> cameras;
  for (const double x : {-0.4, 0.0, 0.4}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0.3 * x, 0, 4}, 160, 120, 160));
  }
  const test::PaneScene planted = test::pane_scene(cameras, 0.06, 1);
  std::vector<ColorImage> left;
  for (const View& view : planted.scene.views) {
    const DepthMap depth = test::true_depth(planted.both, view.camera);
    ColorImage shown(160, 120, Eigen::Vector3f::Zero());
    for (size_t i = 0; i < shown.data.size(); ++i) {
      if (depth.data[i] < 4) shown.data[i] = view.image.data[i] - Eigen::Vector3f::Constant(0.5f);
    }
    left.push_back(std::move(shown));
  }
  const auto priors = test::true_priors(planted.wall, cameras);
  const std::optional<FrontPlane> front = find_front_plane(planted.scene, priors, left);
  ASSERT_TRUE(front.has_value());
  EXPECT_GT(std::abs(front->plane.normal().z()), std::cos(0.05));
  EXPECT_LT(front->plane.absDistance(Vector3d(0, 0, test::kPaneDepth)), 0.03);
  ASSERT_EQ(front->pixels.size(), 3u);
  const std::vector<ColorImage> nothing(3, ColorImage(160, 120, Eigen::Vector3f::Zero()));
  EXPECT_FALSE(find_front_plane(planted.scene, priors, nothing).has_value());
}

}  // namespace
}  // namespace cgs::front_plane_test
