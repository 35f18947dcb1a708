// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/components.h"

#include <gtest/gtest.h>

namespace cgs::components_test {
namespace {

// A unit right triangle and one of a hundredth of its area.
TriangleMesh big_and_small() {
  TriangleMesh mesh;
  mesh.vertices = {
      {9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {5.1f, 0, 0}, {5, 0.1f, 0}};
  mesh.faces = {{1, 2, 3}, {4, 5, 6}};
  mesh.support = {0, 1, 2, 3, 4, 5, 6};
  mesh.provenance = {Provenance::Observed, Provenance::SingleView};
  return mesh;
}

TEST(Components, AreNumberedByTheirFirstFaceAndMeasured) {
  const MeshComponents parts = components(big_and_small());
  EXPECT_EQ(parts.of_face, (std::vector<uint32_t>{0, 1}));
  EXPECT_NEAR(parts.area[0], 0.5, 1e-12);
  EXPECT_NEAR(parts.area[1], 0.005, 1e-8);
}

TEST(GrowOverVertices, TakesNeighboursAndNotTheirs) {
  TriangleMesh strip;
  strip.vertices.resize(7);
  strip.faces = {{0, 1, 2}, {2, 3, 4}, {4, 5, 6}};  // each touches the next at a corner
  std::vector<uint8_t> faces = {1, 0, 0};
  grow_over_vertices(strip, faces);
  EXPECT_EQ(faces, (std::vector<uint8_t>{1, 1, 0}));
}

TEST(WithoutSmallComponents, KeepsAttributesOfWhatStays) {
  const TriangleMesh mesh = without_small_components(big_and_small(), 0.02);
  ASSERT_EQ(mesh.faces.size(), 1U);
  EXPECT_EQ(mesh.vertices.size(), 3U);
  EXPECT_EQ(mesh.vertices[mesh.faces[0][1]], Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(mesh.support, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(mesh.provenance, std::vector<Provenance>{Provenance::Observed});
}

TEST(WithoutSmallComponents, KeepsAllAboveTheLimit) {
  EXPECT_EQ(without_small_components(big_and_small(), 0.005).faces.size(), 2U);
}

TEST(WithoutSmallComponents, TakesAnEmptyMesh) {
  EXPECT_TRUE(without_small_components({}, 0.5).faces.empty());
}

}  // namespace
}  // namespace cgs::components_test
