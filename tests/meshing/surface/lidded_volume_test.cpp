// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/lidded_volume.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/solid_meshes.h"

namespace cgs::lidded_volume_test {
namespace {

TEST(LiddedVolume, ClosesATubeByFlatLids) {
  const TriangleMesh tube = test::tube_mesh(0.5, 2, 96, 4).mesh;
  const double base = 96 / 2.0 * 0.25 * std::sin(2 * std::numbers::pi / 96);
  EXPECT_NEAR(lidded_volume(tube), 2 * base, 1e-5);
}

TEST(LiddedVolume, TellsPartsApart) {
  TriangleMesh far = test::cube_mesh(2).mesh;
  for (auto& p : far.vertices) p.x() += 10;
  far.faces.resize(10);  // one side is missing
  const TriangleMesh both = joined(test::cube_mesh(1).mesh, far);
  const std::vector<double> volumes = lidded_volumes(both, components(both));
  ASSERT_EQ(volumes.size(), 2U);
  EXPECT_NEAR(volumes[0], 1, 1e-6);
  EXPECT_NEAR(volumes[1], 8, 1e-5);
}

TEST(LiddedVolume, IsUnknownWhereFacesDisagree) {
  TriangleMesh cube = test::cube_mesh(1).mesh;
  std::swap(cube.faces[0][0], cube.faces[0][1]);
  EXPECT_TRUE(std::isnan(lidded_volume(cube)));
  EXPECT_TRUE(lidded_volumes(cube, components(cube)).empty());
  EXPECT_TRUE(std::isnan(lidded_volume({})));
}

}  // namespace
}  // namespace cgs::lidded_volume_test
