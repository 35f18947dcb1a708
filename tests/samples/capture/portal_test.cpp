// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/portal.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "samples/capture/solids.h"

namespace cgs::portal_test {
namespace {

double polygon_area(double radius, int sides) {
  return 0.5 * sides * radius * radius * std::sin(2 * std::numbers::pi / sides);
}

TEST(PortalScene, ConsistsOfClosedSolidsThatFaceOutward) {
  const PortalScene scene = portal_scene();
  size_t faces = 0;
  for (const auto& part : scene.parts) {
    const TriangleMesh mesh = part_mesh(scene, part);
    EXPECT_TRUE(is_closed(mesh)) << part.name;
    EXPECT_GT(enclosed_volume(mesh), 0) << part.name;
    faces += mesh.faces.size();
  }
  EXPECT_EQ(faces, scene.mesh.faces.size());
  EXPECT_EQ(scene.part_of_face.size(), scene.mesh.faces.size());
  for (const auto& v : scene.mesh.vertices) ASSERT_TRUE(v.allFinite());
}

TEST(PortalScene, HasMachinePartsOfKnownVolume) {
  const PortalScene scene = portal_scene();
  const auto volume = [&](const std::string& name) {
    for (const auto& part : scene.parts) {
      if (part.name == name) return enclosed_volume(part_mesh(scene, part));
    }
    return 0.0;
  };
  EXPECT_NEAR(volume("pipe"), 0.36 * (polygon_area(0.15, 96) - polygon_area(0.11, 96)), 1e-6);
  EXPECT_NEAR(volume("bored block"),
              0.52 * 0.50 * 0.36 - 0.13 * polygon_area(0.17, 96) - 0.23 * polygon_area(0.11, 96),
              1e-6);
  EXPECT_NEAR(
      volume("flange"),
      0.06 * (polygon_area(0.29, 96) - polygon_area(0.11, 96) - 8 * polygon_area(0.032, 36)),
      1e-6);
}

}  // namespace
}  // namespace cgs::portal_test
