// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/triangle_mesh.h"

#include <gtest/gtest.h>

namespace cgs::triangle_mesh_test {
namespace {

TriangleMesh unit_square() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {9, 9, 9}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  mesh.provenance = {Provenance::Observed, Provenance::Inferred};
  return mesh;
}

TEST(VertexNormals, PointToTheCounterClockwiseSide) {
  const auto normals = vertex_normals(unit_square());
  for (int v = 0; v < 4; ++v) EXPECT_EQ(normals[size_t(v)], Eigen::Vector3f(0, 0, 1));
}

TEST(VertexNormals, AreZeroWithoutAFace) {
  EXPECT_EQ(vertex_normals(unit_square())[4], Eigen::Vector3f::Zero());
}

TEST(FaceArea, IsHalfTheLengthOfTheAreaVector) {
  const TriangleMesh mesh = unit_square();
  EXPECT_EQ(area_vector(mesh, mesh.faces[0]), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(face_area(mesh, mesh.faces[0]), 0.5);
  EXPECT_EQ(face_area(mesh, {0, 1, 1}), 0);
}

TEST(AreaByProvenance, SplitsTheArea) {
  const auto area = area_by_provenance(unit_square());
  EXPECT_DOUBLE_EQ(area[size_t(Provenance::Observed)], 0.5);
  EXPECT_DOUBLE_EQ(area[size_t(Provenance::Inferred)], 0.5);
  EXPECT_DOUBLE_EQ(area[size_t(Provenance::SingleView)], 0);
}

}  // namespace
}  // namespace cgs::triangle_mesh_test
