// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/flat_base.h"

#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "tests/support/solid_meshes.h"

namespace cgs::flat_base_test {
namespace {

// A ball of radius 1 at (4, 5, 6), seen from the side of `front` down to its middle.
TriangleMesh half_seen_ball(const Eigen::Vector3d& front) {
  TriangleMesh out = test::sphere_mesh(1, 64, 128).mesh;
  for (const auto& face : out.faces) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const uint32_t v : face) middle += out.vertices[v].cast<double>();
    out.provenance.push_back(front.dot(middle) > 0 ? Provenance::Observed : Provenance::Inferred);
  }
  out.sigma.assign(out.vertices.size(), 0.01f);
  for (auto& p : out.vertices) p += Eigen::Vector3f(4, 5, 6);
  return out;
}

TEST(FlatBase, CutsAPlateBehindWhatWasSeen) {
  const Eigen::Vector3d front = Eigen::Vector3d(1, -2, 2).normalized();
  const TriangleMesh ball = half_seen_ball(front);
  ASSERT_GT(seen_side(ball).normalized().dot(front), 0.999);
  const FlatBase base = with_flat_base(ball, seen_side(ball), 0.5);
  const Certificate certificate = certify(base.solid.mesh);
  EXPECT_TRUE(certificate.passed());
  // Without the cap of height 0.5 - what faces across the middle reach behind it.
  constexpr double kCap = std::numbers::pi * 0.25 * (3 - 0.5) / 3;
  constexpr double kBall = 4 * std::numbers::pi / 3;
  EXPECT_NEAR(certificate.volume, kBall - kCap, 0.03 * kBall);
  EXPECT_NEAR(base.cut_off, kCap / kBall, 0.03);
  EXPECT_NEAR(certificate.observed_area, certify(ball).observed_area, 1e-4);
  double lowest = 10;
  for (const auto& p : base.solid.mesh.vertices) {
    lowest = std::min(lowest, front.dot(p.cast<double>() - Eigen::Vector3d(4, 5, 6)));
  }
  EXPECT_NEAR(lowest, -0.5, 0.05);
}

TEST(FlatBase, LeavesASolidThatEndsBefore) {
  const TriangleMesh ball = half_seen_ball(Eigen::Vector3d::UnitZ());
  const FlatBase base = with_flat_base(ball, Eigen::Vector3d::UnitZ(), 2);
  EXPECT_EQ(base.solid.mesh.faces.size(), ball.faces.size());
  EXPECT_NEAR(base.cut_off, 0, 1e-9);
}

TEST(FlatBase, KnowsNoSideWhereNothingOrEverythingWasSeen) {
  TriangleMesh ball = half_seen_ball(Eigen::Vector3d::UnitZ());
  ball.provenance.assign(ball.faces.size(), Provenance::Observed);
  EXPECT_TRUE(seen_side(ball).isZero());
  ball.provenance.clear();
  EXPECT_TRUE(seen_side(ball).isZero());
  EXPECT_THROW(with_flat_base(ball, Eigen::Vector3d::Zero(), 1), InvalidInput);
  EXPECT_THROW(with_flat_base(ball, Eigen::Vector3d::UnitZ(), 0), InvalidInput);
}

}  // namespace
}  // namespace cgs::flat_base_test
