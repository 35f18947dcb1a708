// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/vase.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "samples/capture/facade.h"
#include "samples/capture/solids.h"

namespace cgs::vase_test {
namespace {

TEST(VaseScene, ConsistsOfClosedSolidsThatFaceOutward) {
  for (const PortalScene& scene : {vase_scene(), facade_scene()}) {
    for (const auto& part : scene.parts) {
      const TriangleMesh mesh = part_mesh(scene, part);
      EXPECT_TRUE(is_closed(mesh)) << part.name;
      EXPECT_GT(enclosed_volume(mesh), 0) << part.name;
    }
  }
}

// Masks hold the vase whole, and nothing but it.
TEST(VaseScene, StandsWithinEveryPicture) {
  const PortalScene scene = vase_scene();
  ASSERT_EQ(scene.parts.front().name, kVase);
  const std::vector<CaptureView> views = vase_views(3);
  EXPECT_EQ(views.size(), 24U);
  for (const auto& view : views) {
    const Raster<uint8_t> mask = part_mask(scene, view.camera, 0);
    const auto shown = std::count(mask.data.begin(), mask.data.end(), uint8_t{255});
    EXPECT_GT(shown, static_cast<std::ptrdiff_t>(mask.data.size() / 8)) << view.name;
    for (int x = 0; x < mask.width; ++x) {
      EXPECT_EQ(mask(x, 0) + mask(x, mask.height - 1), 0) << view.name;
    }
    EXPECT_TRUE(view.input);
    EXPECT_GT(view.camera.center().z(), 0.1) << "above the table, " << view.name;
  }
}

TEST(FacadeScene, IsLongerThanAPhotographShows) {
  const PortalScene scene = facade_scene();
  const std::vector<CaptureView> views = facade_views(3);
  ASSERT_EQ(views.size(), 25U);
  const DepthMap first = exact_depth(scene, views.front().camera);
  EXPECT_NEAR(double(first(first.width / 2, first.height / 2)), 4.2, 0.4);
  EXPECT_FALSE(views.front().camera.sees(views.front().camera.project({6, 0, 1.5})));
  EXPECT_TRUE(views.back().camera.sees(views.back().camera.project({6, 0, 1.5})));
}

}  // namespace
}  // namespace cgs::vase_test
