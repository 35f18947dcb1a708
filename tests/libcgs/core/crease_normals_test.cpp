// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/crease_normals.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace cgs::crease_normals_test {
namespace {

// Two faces along the x axis; the second is turned upwards by an angle [degrees].
TriangleMesh folded(double angle) {
  const double radians = angle * std::numbers::pi / 180;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0},
                   {1, 0, 0},
                   {0.5f, -1, 0},
                   {0.5f, float(std::cos(radians)), float(std::sin(radians))}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}};
  return mesh;
}

// A prism without lids, of 24 sides: neighbours turn by 15 degrees.
TriangleMesh tube() {
  TriangleMesh mesh;
  constexpr uint32_t kSides = 24;
  for (uint32_t i = 0; i < kSides; ++i) {
    const double a = 2 * std::numbers::pi * i / kSides;
    for (const float z : {0.0f, 1.0f}) {
      mesh.vertices.emplace_back(float(std::cos(a)), float(std::sin(a)), z);
    }
    const uint32_t next = (i + 1) % kSides;
    mesh.faces.push_back({2 * i, 2 * next, 2 * next + 1});
    mesh.faces.push_back({2 * i, 2 * next + 1, 2 * i + 1});
  }
  return mesh;
}

TEST(SplitAtCreases, SharesVerticesWhereFacesHardlyTurn) {
  const ShadingVertices out = split_at_creases(folded(39));
  EXPECT_EQ(out.vertex, (std::vector<uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(out.faces, folded(39).faces);
}

TEST(SplitAtCreases, GivesEachSideOfACreaseItsOwnNormal) {
  const ShadingVertices out = split_at_creases(folded(90));
  EXPECT_EQ(out.vertex, (std::vector<uint32_t>{0, 0, 1, 1, 2, 3}));
  for (const uint32_t v : out.faces[0]) {
    EXPECT_LT((out.normal[v] - Eigen::Vector3f(0, 0, 1)).norm(), 1e-6f);
  }
  for (const uint32_t v : out.faces[1]) {
    EXPECT_LT((out.normal[v] - Eigen::Vector3f(0, -1, 0)).norm(), 1e-6f);
  }
  for (size_t f = 0; f < 2; ++f) {
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(out.vertex[out.faces[f][k]], folded(90).faces[f][k]);
    }
  }
}

TEST(SplitAtCreases, KeepsWhatIsRoundSmooth) {
  const TriangleMesh mesh = tube();
  const ShadingVertices out = split_at_creases(mesh);
  ASSERT_EQ(out.vertex.size(), mesh.vertices.size());
  for (size_t i = 0; i < out.vertex.size(); ++i) {
    Eigen::Vector3f radial = mesh.vertices[out.vertex[i]];
    radial.z() = 0;
    EXPECT_GT(out.normal[i].dot(radial), std::cos(8 * std::numbers::pi / 180));
  }
}

// A third face at an edge leaves open which two belong together.
TEST(SplitAtCreases, SplitsWhereThreeFacesMeet) {
  TriangleMesh mesh = folded(0);
  mesh.vertices.emplace_back(0.5f, 0, 1);
  mesh.faces.push_back({0, 1, 4});
  EXPECT_EQ(split_at_creases(mesh).vertex.size(), 9U);
}

TEST(SplitAtCreases, HasAVertexForFacesWithoutAreaAndNoneWithoutFaces) {
  TriangleMesh mesh;
  mesh.vertices = {{5, 5, 5}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  mesh.faces = {{1, 2, 3}};
  const ShadingVertices out = split_at_creases(mesh);
  EXPECT_EQ(out.vertex, (std::vector<uint32_t>{1, 2, 3}));
  for (const Eigen::Vector3f& n : out.normal) EXPECT_EQ(n, Eigen::Vector3f::Zero());
}

}  // namespace
}  // namespace cgs::crease_normals_test
