// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/loop_subdivision.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::loop_subdivision_test {
namespace {

TEST(LoopSubdivided, MovesAnOctahedronAsLoopSays) {
  TriangleMesh octahedron;
  octahedron.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  octahedron.faces = {
      {0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  const TriangleMesh out = loop_subdivided(octahedron, 1);
  ASSERT_EQ(out.vertices.size(), 6U + 12U);
  ASSERT_EQ(out.faces.size(), 32U);
  // Four neighbours whose sum is 0, each with (5/8 - (3/8)^2) / 4.
  for (size_t v = 0; v < 6; ++v) {
    EXPECT_LT((out.vertices[v] - 0.515625f * octahedron.vertices[v]).norm(), 1e-6f);
  }
  // The two tips beside an edge are opposite to each other.
  for (size_t v = 6; v < 18; ++v) {
    EXPECT_NEAR(out.vertices[v].cwiseAbs().sum(), 0.75f, 1e-6f);
    EXPECT_NEAR(out.vertices[v].cwiseAbs().maxCoeff(), 0.375f, 1e-6f);
  }
  EXPECT_TRUE(certify(out).passed());
}

TEST(LoopSubdivided, LeavesAPlaneWithItsRimWhereItIs) {
  const TriangleMesh sheet =
      test::grid_mesh(4, 6, [](double s, double t) { return Eigen::Vector3d(s, 2 * t, 0.5); }).mesh;
  const TriangleMesh out = loop_subdivided(sheet, 2);
  for (const auto& p : out.vertices) EXPECT_EQ(p.z(), 0.5f);
  // Only the four corners are rounded, by a curve in the rim.
  EXPECT_NEAR(certify(out).area, 2, 0.03);
  EXPECT_LT(certify(out).area, 2);
  size_t on_rim = 0;
  for (const auto& p : out.vertices) on_rim += p.x() == 0 ? 1 : 0;
  EXPECT_GT(on_rim, 15U);
}

TEST(LoopSubdivided, KeepsTheKindOfSurface) {
  const TriangleMesh torus = test::torus_mesh(1, 0.4, 24, 12).mesh;
  const Certificate out = certify(loop_subdivided(torus, 2));
  EXPECT_TRUE(out.passed());
  EXPECT_EQ(out.euler_number, 0);
  EXPECT_NEAR(out.volume / certify(torus).volume, 1, 0.06);
}

TEST(LoopSubdivided, WhatWasInventedDoesNotDragWhatWasSeen) {
  TriangleMesh ball = test::labelled_sphere(24, 32);
  const TriangleMesh out = loop_subdivided(ball, 1);
  // Another shape of the invented half leaves the other one as it was.
  for (auto& p : ball.vertices) {
    if (p.z() < 0.14f) p *= 1.3f;
  }
  const TriangleMesh other = loop_subdivided(ball, 1);
  const auto area = area_by_provenance(out);
  const auto other_area = area_by_provenance(other);
  EXPECT_EQ(area[size_t(Provenance::Observed)], other_area[size_t(Provenance::Observed)]);
  EXPECT_EQ(area[size_t(Provenance::SingleView)], other_area[size_t(Provenance::SingleView)]);
  EXPECT_NE(area[size_t(Provenance::Inferred)], other_area[size_t(Provenance::Inferred)]);
}

TEST(LoopSubdivided, SigmaHoldsHowFarAVertexMoved) {
  const TriangleMesh ball = test::labelled_sphere(24, 32);
  const TriangleMesh out = loop_subdivided(ball, 1);
  size_t sure = 0;
  for (size_t v = 0; v < ball.vertices.size(); ++v) {
    if (std::isnan(ball.sigma[v])) continue;
    const double moved = (out.vertices[v] - ball.vertices[v]).cast<double>().norm();
    EXPECT_NEAR(out.sigma[v], std::hypot(double{ball.sigma[v]}, moved), 1e-6);
    ++sure;
  }
  EXPECT_GT(sure, 200U);
  EXPECT_EQ(out.provenance.size(), out.faces.size());
  EXPECT_THROW(loop_subdivided(ball, 20), LimitError);
}

}  // namespace
}  // namespace cgs::loop_subdivision_test
