// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/face_adjacency.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"

namespace cgs::face_adjacency_test {
namespace {

TEST(SidesByEdge, StandInPairsOfAClosedSurface) {
  const TriangleMesh mesh = test::labelled_sphere();
  const std::vector<FaceSide> sides = sides_by_edge(mesh);
  ASSERT_EQ(sides.size(), 3 * mesh.faces.size());
  for (size_t i = 0; i < sides.size(); i += 2) {
    EXPECT_TRUE(sides[i].same_edge(sides[i + 1]));
    EXPECT_LT(sides[i].face, sides[i + 1].face);
    for (const FaceSide& side : {sides[i], sides[i + 1]}) {
      const auto& face = mesh.faces[side.face];
      const auto [low, high] = std::minmax(face.at(side.side), face.at((side.side + 1) % 3));
      EXPECT_EQ(low, side.low);
      EXPECT_EQ(high, side.high);
    }
  }
}

TEST(SidesByEdge, StandAloneAtABorderAndTogetherWhereMoreMeet) {
  TriangleMesh mesh;
  mesh.vertices.resize(5);
  mesh.faces = {{0, 1, 2}, {2, 1, 3}, {1, 2, 4}};
  const std::vector<FaceSide> sides = sides_by_edge(mesh);
  std::vector<size_t> faces_of_edge;
  for (size_t i = 0; i < sides.size(); ++i) {
    if (i == 0 || !sides[i].same_edge(sides[i - 1])) faces_of_edge.push_back(0);
    ++faces_of_edge.back();
  }
  // 0-1, 0-2, 1-2, 1-3, 1-4, 2-3, 2-4
  EXPECT_EQ(faces_of_edge, (std::vector<size_t>{1, 1, 3, 1, 1, 1, 1}));
}

}  // namespace
}  // namespace cgs::face_adjacency_test
