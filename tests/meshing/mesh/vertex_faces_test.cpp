// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/vertex_faces.h"

#include <gtest/gtest.h>

namespace cgs::vertex_faces_test {
namespace {

TEST(FacesOfVertices, AreThoseThatNameThemInAscendingOrder) {
  const std::vector<std::array<uint32_t, 3>> faces = {{0, 1, 2}, {2, 1, 4}, {4, 0, 2}};
  const VertexFaces around = faces_of_vertices(6, faces);
  const auto of = [&](size_t v) {
    return std::vector<uint32_t>(around.of(v).begin(), around.of(v).end());
  };
  EXPECT_EQ(of(0), (std::vector<uint32_t>{0, 2}));
  EXPECT_EQ(of(1), (std::vector<uint32_t>{0, 1}));
  EXPECT_EQ(of(2), (std::vector<uint32_t>{0, 1, 2}));
  EXPECT_TRUE(of(3).empty());
  EXPECT_EQ(of(4), (std::vector<uint32_t>{1, 2}));
  EXPECT_TRUE(of(5).empty());
}

TEST(FacesOfVertices, AreNoneWithoutFaces) {
  const VertexFaces around = faces_of_vertices(2, {});
  EXPECT_TRUE(around.of(1).empty());
  EXPECT_EQ(faces_of_vertices(0, {}).first.size(), 1U);
}

}  // namespace
}  // namespace cgs::vertex_faces_test
