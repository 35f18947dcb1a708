// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/face_adjacency.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"

namespace cgs::face_adjacency_test {
namespace {

TEST(AdjacentFaces, ShareTheEdgeTheyStandFor) {
  const TriangleMesh mesh = test::labelled_sphere();
  const auto adjacent = adjacent_faces(mesh);
  ASSERT_EQ(adjacent.size(), mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const auto& other = mesh.faces[adjacent[f].at(k)];
      EXPECT_NE(adjacent[f].at(k), f);  // the sphere is closed
      for (const size_t corner : {k, (k + 1) % 3}) {
        EXPECT_EQ(std::count(other.begin(), other.end(), mesh.faces[f].at(corner)), 1);
      }
    }
  }
}

TEST(AdjacentFaces, AreTheFaceItselfAtABorder) {
  TriangleMesh mesh;
  mesh.vertices.resize(4);
  mesh.faces = {{0, 1, 2}, {2, 1, 3}};
  const auto adjacent = adjacent_faces(mesh);
  EXPECT_EQ(adjacent[0], (std::array<uint32_t, 3>{0, 1, 0}));
  EXPECT_EQ(adjacent[1], (std::array<uint32_t, 3>{0, 1, 1}));
}

}  // namespace
}  // namespace cgs::face_adjacency_test
