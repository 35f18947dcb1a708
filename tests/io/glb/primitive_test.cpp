// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/primitive.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/up_axis.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::glb_primitive_test {
namespace {

TEST(GlbPrimitives, SplitTheMeshIntoItsClasses) {
  const TriangleMesh mesh = test::labelled_sphere();
  const auto parts = glb_primitives(mesh, {});
  ASSERT_EQ(parts.size(), 4u);
  EXPECT_EQ(parts[0].name, "observed");
  EXPECT_EQ(parts[1].name, "single view");
  EXPECT_EQ(parts[2].name, "interpolated");
  EXPECT_EQ(parts[3].name, "inferred");
  constexpr std::array<Provenance, 4> kLabels = {
      Provenance::Observed, Provenance::SingleView, Provenance::Interpolated, Provenance::Inferred};
  for (size_t p = 0; p < 4; ++p) {  // corners keep their places and their order
    size_t next = 0;
    for (size_t i = 0; i < mesh.faces.size(); ++i) {
      if (mesh.provenance[i] != kLabels.at(p)) continue;
      ASSERT_LT(next, parts[p].faces.size());
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t before = mesh.faces[i].at(k);
        const uint32_t after = parts[p].faces[next].at(k);
        EXPECT_EQ(parts[p].positions[after], mesh.vertices[before]);
        EXPECT_EQ(parts[p].support[after], mesh.support[before]);
      }
      ++next;
    }
    EXPECT_EQ(next, parts[p].faces.size());
    EXPECT_EQ(parts[p].normals.size(), parts[p].positions.size());
    EXPECT_EQ(parts[p].sigma.size(), parts[p].positions.size());
  }
}

TEST(GlbPrimitives, PlacementTurnsScalesAndCentres) {
  const GlbPlacement placement{y_up_from(Eigen::Vector3d::UnitZ()), 2, {1, 2, 3}};
  EXPECT_EQ(placement({1, 2, 4}), Eigen::Vector3f(0, 2, 0));
  EXPECT_EQ(placement({1, 3, 3}), Eigen::Vector3f(0, 0, -2));
  TriangleMesh mesh = test::labelled_sphere();
  const auto parts = glb_primitives(mesh, placement);
  EXPECT_LT((parts[0].normals[0] - Eigen::Vector3f::UnitY()).norm(), 1e-6f);  // north pole
  EXPECT_FLOAT_EQ(parts[0].sigma[0], 2 * mesh.sigma[0]);
}

// A viewer interpolates between the normals of a face: they must not lean towards its neighbours.
TEST(GlbPrimitives, HaveSharpCreasesWhereTheMeshHasNoNormals) {
  const TriangleMesh mesh = test::cube_mesh().mesh;
  const auto parts = glb_primitives(mesh, {});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].positions.size(), 6u * 4);
  ASSERT_EQ(parts[0].faces.size(), mesh.faces.size());
  for (const auto& face : parts[0].faces) {
    const Eigen::Vector3f a = parts[0].positions[face[0]];
    const Eigen::Vector3f across =
        (parts[0].positions[face[1]] - a).cross(parts[0].positions[face[2]] - a).normalized();
    for (const uint32_t v : face) EXPECT_LT((parts[0].normals[v] - across).norm(), 1e-6f);
  }
}

TEST(GlbPrimitives, HoldNoNanWhateverTheMeshHolds) {
  TriangleMesh mesh = test::labelled_sphere();
  const float nan = std::nanf("");
  for (size_t i = 0; i < mesh.vertices.size(); i += 2) {
    mesh.normals[i].setConstant(nan);
    mesh.colors[i] = Eigen::Vector3f(nan, -4, 9);
    mesh.support[i] = nan;
    mesh.sigma[i] = i % 4 == 0 ? nan : std::numeric_limits<float>::infinity();
  }
  for (const GlbPrimitive& part : glb_primitives(mesh, {})) {
    for (size_t i = 0; i < part.positions.size(); ++i) {
      EXPECT_NEAR(part.normals[i].norm(), 1, 1e-5);
      EXPECT_GE(part.colors[i].minCoeff(), 0);
      EXPECT_LE(part.colors[i].maxCoeff(), 1);
      EXPECT_TRUE(std::isfinite(part.support[i]) && std::isfinite(part.sigma[i]));
    }
  }
}

TEST(GlbPrimitives, HoldSupportAndSigmaWithinBoundsWhateverTheMeshHolds) {
  TriangleMesh mesh = test::labelled_sphere();
  constexpr float kHuge = std::numeric_limits<float>::max();
  for (size_t i = 0; i < mesh.vertices.size(); i += 2) {
    mesh.support[i] = i % 4 == 0 ? -kHuge : kHuge;
    mesh.sigma[i] = i % 4 == 0 ? -kHuge : kHuge;
  }
  for (const GlbPrimitive& part : glb_primitives(mesh, {})) {
    for (size_t i = 0; i < part.positions.size(); ++i) {
      EXPECT_GE(part.support[i], 0);
      EXPECT_LE(part.support[i], 65535);
      EXPECT_LE(std::abs(part.sigma[i]), 1e18);
    }
  }
}

TEST(GlbPrimitives, UnknownSigmaIsNegativeAndNotLarge) {
  const TriangleMesh mesh = test::labelled_sphere();
  const auto parts = glb_primitives(mesh, {.scale = 3});
  float largest = 0;
  for (const float s : parts[1].sigma) largest = std::max(largest, s);
  EXPECT_LT(parts[3].sigma.front(), 0);
  EXPECT_GE(parts[3].sigma.front(), -0.25f * largest);
}

TEST(GlbPrimitives, DropFacesWithoutThreePlaces) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {9, 9, 9}};
  mesh.faces = {{0, 1, 2}, {0, 1, 3}, {0, 0, 2}};
  const auto parts = glb_primitives(mesh, {});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].name, "surface");
  EXPECT_EQ(parts[0].faces.size(), 1u);
  EXPECT_EQ(parts[0].positions.size(), 3u);
  EXPECT_EQ(parts[0].normals[0], Eigen::Vector3f::UnitZ());
  mesh.faces = {{0, 0, 0}};
  EXPECT_TRUE(glb_primitives(mesh, {}).empty());
}

}  // namespace
}  // namespace cgs::glb_primitive_test
