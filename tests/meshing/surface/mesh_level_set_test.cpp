// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/mesh_level_set.h"

#include <cmath>
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

TEST(EnclosingLevelSet, RefusesTooManyVoxels) {
  EXPECT_THROW(enclosing_level_set(test::cube_mesh(1).mesh, 1e-5), LimitError);
}

}  // namespace
}  // namespace cgs::mesh_level_set_test
