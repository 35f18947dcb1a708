// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/courtyard.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "samples/capture/render.h"
#include "samples/capture/solids.h"

namespace cgs::courtyard_test {
namespace {

using Eigen::Vector3d;

// Name of the part that a ray from a camera to a point of the world first meets; empty = none.
std::string part_before(const PortalScene& scene, const Camera& camera, const Vector3d& point) {
  const auto hit = first_hit(scene.bvh, {camera.center(), point - camera.center()});
  return hit ? scene.parts[scene.part_of_face[hit->face]].name : "";
}

TEST(CourtyardScene, ConsistsOfClosedSolidsThatFaceOutward) {
  const PortalScene scene = courtyard_scene();
  for (const auto& part : scene.parts) {
    const TriangleMesh mesh = part_mesh(scene, part);
    EXPECT_TRUE(is_closed(mesh)) << part.name;
    EXPECT_GT(enclosed_volume(mesh), 0) << part.name;
  }
}

TEST(CourtyardScene, HasSkyInEveryViewWithBarsBeforeIt) {
  const PortalScene scene = courtyard_scene();
  for (const auto& view : courtyard_views(3)) {
    const DepthMap depth = exact_depth(scene, view.camera);
    const auto sky =
        std::count_if(depth.data.begin(), depth.data.end(), [](float z) { return std::isnan(z); });
    const double share = static_cast<double>(sky) / static_cast<double>(depth.data.size());
    EXPECT_GT(share, 0.15) << view.name;
    EXPECT_LT(share, 0.50) << view.name;
    EXPECT_EQ(part_before(scene, view.camera, {-0.85, 0.12, 3.5}), "pole") << view.name;
    EXPECT_EQ(part_before(scene, view.camera, {-0.80, 0.12, 3.5}), "") << view.name;
  }
}

TEST(CourtyardScene, LetsRaysThroughTheGlassIntoTheRoom) {
  const PortalScene scene = courtyard_scene();
  ASSERT_EQ(scene.panes.size(), 1U);
  const GlassPane& pane = scene.panes.front();
  const Vector3d middle = pane.corner + 0.5 * (pane.across + pane.up);
  const Camera camera = courtyard_views()[1].camera;
  EXPECT_EQ(part_before(scene, camera, middle), "room back");
  const Vector3d uvz = camera.project(middle);
  const DepthMap depth = exact_depth(scene, camera);
  EXPECT_NEAR(static_cast<double>(depth(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()))),
              uvz.z() + 1.5,
              0.05);
}

TEST(CourtyardScene, MirrorsTheSkyInTheGlass) {
  PortalScene scene = courtyard_scene();
  const std::vector<float> sky(scene.mesh.vertices.size(), 0.8F);
  const Camera camera = courtyard_views(6)[1].camera;
  const Vector3d uvz = camera.project(scene.panes.front().corner + Vector3d(0.5, 0, 0.5));
  const auto shown = [&] {
    return render_view(scene, sky, camera, 1)(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
  };
  const Eigen::Vector3f with_pane = shown();
  scene.panes.clear();
  EXPECT_GT(with_pane.z(), shown().z() + 0.05F);
}

TEST(CourtyardScene, ShowsNothingOnItsWhiteWall) {
  const PortalScene scene = courtyard_scene();
  const std::vector<float> sky(scene.mesh.vertices.size(), 0.8F);
  const Camera camera = courtyard_views(2)[1].camera;
  const ColorImage image = render_view(scene, sky, camera, 1);
  double sum = 0;
  double squares = 0;
  int count = 0;
  for (double x = 1.5; x < 2.6; x += 0.05) {
    for (double z = 0.3; z < 2.2; z += 0.05) {
      const Vector3d point(x, -1.25, z);
      ASSERT_EQ(part_before(scene, camera, point), "white wall") << x << " " << z;
      const Vector3d uvz = camera.project(point);
      const Eigen::Vector3f color = image(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
      ASSERT_LT(color.maxCoeff(), 1);  // not clipped
      const double level = 255 * static_cast<double>(color.x());
      sum += level;
      squares += level * level;
      ++count;
    }
  }
  const double mean = sum / count;
  EXPECT_GT(mean, 200);
  // Noise of half a level, and rounding.
  EXPECT_LT(std::sqrt(std::max(0.0, squares / count - mean * mean)), 0.8);
}

TEST(CourtyardScene, LeavesThePortalAsItWas) {
  const PortalScene scene = portal_scene();
  EXPECT_EQ(scene.mesh.faces.size(), 796440U);
  EXPECT_TRUE(scene.panes.empty());
  EXPECT_FALSE(scene.sky);
  EXPECT_EQ(scene.exposure, 1);
}

TEST(CourtyardViews, StandAsThoseOfThePortal) {
  const auto views = courtyard_views(2);
  const auto portal = capture_views(2);
  ASSERT_EQ(views.size(), portal.size());
  for (size_t i = 0; i < views.size(); ++i) {
    EXPECT_EQ(views[i].name, portal[i].name);
    EXPECT_EQ(views[i].input, portal[i].input);
    EXPECT_EQ(views[i].camera.width, 252);
  }
}

}  // namespace
}  // namespace cgs::courtyard_test
