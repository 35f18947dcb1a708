// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/mesh_level_set.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/vertex_attributes.h"
#include "meshing/surface/closed_isosurface.h"
#include "tests/support/solid_meshes.h"

namespace cgs::mesh_level_set_test {
namespace {

TEST(EnclosingLevelSet, IsAsLargeAsTheSolidAndItsMeshLiesOnIt) {
  const auto field = enclosing_level_set(test::sphere_mesh(1, 96, 192).mesh, 0.03);
  const double ball = 4 * std::numbers::pi / 3;
  EXPECT_NEAR(enclosed_by_level_set(*field) / ball, 1, 0.003);
  const ClosedIsosurface out = closed_isosurface(*field);
  EXPECT_TRUE(out.certificate.passed());
  EXPECT_NEAR(out.certificate.volume / ball, 1, 0.003);
  for (const auto& p : out.mesh.vertices) EXPECT_NEAR(double(p.norm()), 1, 0.1 * 0.03);
}

// Two balls through each other, one of them inside out.
TEST(EnclosingLevelSet, IsTheOutsideOfFacesThatCutEachOther) {
  TriangleMesh other = test::sphere_mesh(1, 96, 192).mesh;
  for (auto& p : other.vertices) p.x() += 1;
  for (auto& f : other.faces) std::swap(f[1], f[2]);
  const auto field = enclosing_level_set(joined(test::sphere_mesh(1, 96, 192).mesh, other), 0.03);
  const double lens = std::numbers::pi * (4 + 1) / 12;  // of two unit balls, centres 1 apart
  EXPECT_NEAR(enclosed_by_level_set(*field), 8 * std::numbers::pi / 3 - lens, 0.03);
  EXPECT_TRUE(closed_isosurface(*field).certificate.passed());
}

// Its faces pass through voxels, where the field is 0.
TEST(ClosedIsosurfaceOfABox, OnTheGridHasNoDegenerateFacesAndTheEulerNumberOfABall) {
  constexpr int kHalf = 8;  // of the edge, as all in voxels
  constexpr int kBand = 3;
  constexpr float kVoxel = 1.0f / 16;
  const auto field = openvdb::FloatGrid::create(kBand * kVoxel);
  field->setTransform(openvdb::math::Transform::createLinearTransform(double{kVoxel}));
  auto access = field->getAccessor();
  constexpr int kReach = kHalf + kBand;
  for (int x = -kReach; x <= kReach; ++x) {
    for (int y = -kReach; y <= kReach; ++y) {
      for (int z = -kReach; z <= kReach; ++z) {
        const int away = std::max({std::abs(x), std::abs(y), std::abs(z)}) - kHalf;
        const auto value = kVoxel * static_cast<float>(std::clamp(away, -kBand, kBand));
        access.setValueOnly({x, y, z}, value);
        if (std::abs(away) < kBand) access.setValueOn({x, y, z});
      }
    }
  }
  const ClosedIsosurface out = closed_isosurface(*field);
  EXPECT_TRUE(out.certificate.passed());
  EXPECT_EQ(out.certificate.components, 1u);
  EXPECT_EQ(out.certificate.genus, 0);
  EXPECT_NEAR(out.certificate.volume, 1, 0.05);  // edges are cut off
  for (const auto& f : out.mesh.faces) {
    const Eigen::Vector3f u = out.mesh.vertices[f[1]] - out.mesh.vertices[f[0]];
    const Eigen::Vector3f v = out.mesh.vertices[f[2]] - out.mesh.vertices[f[0]];
    ASSERT_GT(u.cross(v).norm(), 0);
  }
}

TEST(EnclosingLevelSet, RefusesTooManyVoxels) {
  EXPECT_THROW(enclosing_level_set(test::cube_mesh(1).mesh, 1e-5), LimitError);
}

}  // namespace
}  // namespace cgs::mesh_level_set_test
