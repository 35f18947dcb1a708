// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/vertex_attributes.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"

namespace cgs::vertex_attributes_test {
namespace {

TEST(AppendBlend, LiesBetweenAndClaimsNoMoreThanItsParts) {
  TriangleMesh from;
  from.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 8, 0}};
  from.colors = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  from.normals = {{0, 0, 1}, {1, 0, 0}, {0, 0, 1}};
  from.support = {5, 2, 0};
  from.sigma = {0.1f, 0.5f, std::nanf("")};
  TriangleMesh to;
  append_blend(to, from, std::vector<VertexShare>{{0, 0.75f}, {1, 0.25f}, {2, 0}});
  append_blend(to, from, std::vector<VertexShare>{{0, 0.5f}, {2, 0.5f}});
  EXPECT_EQ(to.vertices[0], Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(to.colors[0], Eigen::Vector3f(0.25f, 0, 0));
  EXPECT_NEAR((to.normals[0] - Eigen::Vector3f(1, 0, 3).normalized()).norm(), 0, 1e-6);
  EXPECT_EQ(to.support, (std::vector<float>{2, 0}));
  EXPECT_FLOAT_EQ(to.sigma[0], 0.2f);
  EXPECT_TRUE(std::isnan(to.sigma[1]));
}

TEST(WithVertices, KeepsTheFacesBetweenThem) {
  const TriangleMesh ball = test::labelled_sphere();
  std::vector<uint8_t> keep(ball.vertices.size(), 1);
  keep[0] = 0;  // the pole, where all sectors meet
  const TriangleMesh out = with_vertices(ball, keep);
  EXPECT_EQ(out.vertices.size(), ball.vertices.size() - 1);
  EXPECT_EQ(out.faces.size(), ball.faces.size() - 16);
  EXPECT_EQ(out.provenance.size(), out.faces.size());
  EXPECT_EQ(out.sigma[0], ball.sigma[1]);
}

TEST(Joined, FillsInNothingThatWouldBeAClaim) {
  const TriangleMesh ball = test::labelled_sphere();
  TriangleMesh bare;
  bare.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  bare.faces = {{0, 1, 2}};
  for (const bool first : {true, false}) {
    const TriangleMesh out = first ? joined(bare, ball) : joined(ball, bare);
    const size_t v = first ? 0 : ball.vertices.size();
    const size_t f = first ? 0 : ball.faces.size();
    EXPECT_EQ(out.provenance.size(), out.faces.size());
    EXPECT_EQ(out.provenance[f], Provenance::Inferred);
    EXPECT_EQ(out.faces[f][2], v + 2);
    EXPECT_TRUE(std::isnan(out.sigma[v]));
    EXPECT_EQ(out.support[v], 0);
    EXPECT_EQ(out.normals[v], Eigen::Vector3f(0, 0, 1));
    EXPECT_EQ(out.colors.size(), out.vertices.size());
    EXPECT_NEAR(area_by_provenance(out)[2], area_by_provenance(ball)[2], 1e-9);
  }
  EXPECT_TRUE(joined(bare, bare).provenance.empty());
}

}  // namespace
}  // namespace cgs::vertex_attributes_test
