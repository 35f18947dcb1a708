// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/reef.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "samples/capture/solids.h"

namespace cgs::reef_test {
namespace {

TEST(ReefScene, GrowsAndLosesWhatItSays) {
  const ReefGrowth growth;
  const ReefKnob knob;
  EXPECT_EQ(grown_by(growth.x, growth.z), growth.thickness);
  EXPECT_EQ(grown_by(growth.x + 1.001 * growth.radius, growth.z), 0);
  EXPECT_EQ(knob_height(knob.x, knob.z), knob.height);
  // Of (1 - t^2)^2 over a disc: a third of the cylinder around it.
  const double cylinder = std::numbers::pi * knob.radius * knob.radius * knob.height;
  EXPECT_NEAR(reef_loss(), cylinder / 3, 0.01 * cylinder);
  const double disc = std::numbers::pi * growth.radius * growth.radius * growth.thickness;
  EXPECT_LT(reef_gain(), disc);
  EXPECT_GT(reef_gain(), 0.7 * disc);
}

TEST(ReefScene, IsTheSameElsewhereAtBothDates) {
  const PortalScene earlier = reef_scene(ReefDate::Earlier);
  const PortalScene later = reef_scene(ReefDate::Later);
  ASSERT_EQ(earlier.mesh.vertices.size(), later.mesh.vertices.size());
  size_t moved_vertices = 0;
  for (size_t v = 0; v < earlier.mesh.vertices.size(); ++v) {
    const Eigen::Vector3f& p = earlier.mesh.vertices[v];
    if (p == later.mesh.vertices[v]) continue;
    ++moved_vertices;
    EXPECT_TRUE(grown_by(double(p.x()), double(p.z())) > 0 ||
                knob_height(double(p.x()), double(p.z())) > 0);
  }
  EXPECT_GT(moved_vertices, 500U);
  for (const auto& part : later.parts) {
    EXPECT_TRUE(is_closed(part_mesh(later, part))) << part.name;
    EXPECT_GT(enclosed_volume(part_mesh(later, part)), 0) << part.name;
  }
  EXPECT_NE(reef_views(ReefDate::Earlier, 3).front().camera.center(),
            reef_views(ReefDate::Later, 3).front().camera.center());
}

}  // namespace
}  // namespace cgs::reef_test
