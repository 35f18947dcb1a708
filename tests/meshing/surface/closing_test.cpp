// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/closing.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "meshing/edit/boolean.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/damaged_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::closing_test {
namespace {

constexpr double kPi = std::numbers::pi;

// A torus with bumps: nothing about it is convex, and it has a handle.
TriangleMesh bumpy_ring() {
  TriangleMesh out = test::torus_mesh(1, 0.4, 96, 48).mesh;
  const std::vector<Eigen::Vector3f> normals = vertex_normals(out);
  for (size_t v = 0; v < normals.size(); ++v) {
    const Eigen::Vector3f& p = out.vertices[v];
    const float bump = std::sin(9 * p.x()) * std::sin(8 * p.y()) * std::cos(7 * p.z());
    out.vertices[v] += 0.06f * bump * normals[v];
  }
  return out;
}

const std::string& way_of(const ClosedMesh& closed) { return closed.attempts[closed.taken].way; }

TEST(ClosedMesh, LeavesACertifiedMeshAsItIs) {
  const TriangleMesh ring = bumpy_ring();
  const ClosedMesh out = closed_mesh(ring);
  EXPECT_EQ(out.mesh.vertices, ring.vertices);
  EXPECT_EQ(out.mesh.faces, ring.faces);
  ASSERT_EQ(out.attempts.size(), 1U);
  EXPECT_EQ(way_of(out), "repair");
  EXPECT_EQ(out.attempts[0].reason, "");
  EXPECT_LT(out.deviation.hausdorff(), 1e-6);
}

class DamagedMesh : public testing::TestWithParam<uint32_t> {};

TEST_P(DamagedMesh, IsClosedNearTheUndamagedSurface) {
  const TriangleMesh ring = bumpy_ring();
  const test::Damage damage = test::kDamages.at(GetParam() % test::kDamages.size());
  const TriangleMesh broken = test::damaged(ring, damage, GetParam());
  const ClosedMesh out = closed_mesh(broken);
  EXPECT_EQ(why_no_solid(out.mesh), "");
  EXPECT_TRUE(out.certificate.passed());
  EXPECT_EQ(out.attempts[out.taken].reason, "") << way_of(out);
  const double volume = certify(ring).volume;
  EXPECT_NEAR(out.certificate.volume / volume, 1, 0.02) << way_of(out);
  const MeshDistance off = mesh_distance(out.mesh, ring, 50'000);
  constexpr double kDiagonal = 4;
  EXPECT_LT(off.accuracy.rms, 0.005 * kDiagonal) << way_of(out);
  EXPECT_LT(off.completeness.rms, 0.005 * kDiagonal) << way_of(out);
}

INSTANTIATE_TEST_SUITE_P(Seeds, DamagedMesh, testing::Range(0U, 14U));

TEST(ClosedMesh, WhatClosesAHoleIsInferredAndTheRestStaysAsItWas) {
  MeasurableMesh ball = test::sphere_mesh(1, 48, 96);
  ball.mesh.provenance.assign(ball.mesh.faces.size(), Provenance::Observed);
  ball.mesh.sigma.assign(ball.points.size(), 0.01f);
  std::vector<uint8_t> keep;
  for (const auto& f : ball.mesh.faces) keep.push_back(ball.points[f[0]].z() < 0.9 ? 1 : 0);
  const TriangleMesh open = with_faces(ball.mesh, keep);
  const ClosedMesh out = closed_mesh(open);
  EXPECT_EQ(way_of(out), "fill-holes");
  EXPECT_EQ(out.attempts[0].reason, "is not closed");
  EXPECT_NEAR(out.certificate.observed_area, certify(open).area, 1e-4);
  EXPECT_GT(out.certificate.inferred_area, 0.1);
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    if (out.mesh.provenance[f] == Provenance::Inferred) continue;
    for (const uint32_t v : out.mesh.faces[f]) EXPECT_EQ(out.mesh.sigma[v], 0.01f);
  }
  // Of the lid, which the input does not have, only the one way tells.
  EXPECT_LT(out.deviation.completeness.max, 1e-5);
  EXPECT_GT(out.deviation.accuracy.max, 0.02);
}

TEST(ClosedMesh, TakesTheOutsideOfBallsThatCutEachOther) {
  TriangleMesh balls = test::sphere_mesh(1, 48, 96).mesh;
  TriangleMesh other = balls;
  for (auto& p : other.vertices) p.x() += 1;
  const ClosedMesh out = closed_mesh(joined(balls, other));
  EXPECT_EQ(why_no_solid(out.mesh), "");
  const double lens = kPi * (4 + 1) / 12;
  EXPECT_NEAR(out.certificate.volume, 8 * kPi / 3 - lens, 0.03) << way_of(out);
  EXPECT_EQ(out.attempts[out.taken].reason, "") << way_of(out);
}

TriangleMesh moved(TriangleMesh mesh, float size, const Eigen::Vector3f& to) {
  for (auto& p : mesh.vertices) p = size * p + to;
  return mesh;
}

TEST(ClosedMesh, NeverFillsACavityUnnoticed) {
  const TriangleMesh ball = test::sphere_mesh(1, 48, 96).mesh;
  TriangleMesh hollow = joined(ball, moved(ball, 0.8f, {0, 0, 0}));
  const size_t outer = ball.faces.size();
  for (size_t f = outer; f < hollow.faces.size(); ++f) {
    std::swap(hollow.faces[f][0], hollow.faces[f][1]);
  }
  const ClosedMesh whole = closed_mesh(hollow);
  EXPECT_NEAR(whole.certificate.volume, 4 * kPi / 3 * (1 - 0.512), 0.03) << way_of(whole);
  // A grain that cuts the outside calls for less gentle ways.
  const ClosedMesh stuck = closed_mesh(joined(hollow, moved(ball, 0.03f, {1, 0, 0})));
  const bool is_filled = stuck.certificate.volume > 3;
  const bool says_nothing = stuck.inside < 0.01;
  EXPECT_TRUE(is_filled || says_nothing) << stuck.certificate.volume << ", " << stuck.inside;
  if (is_filled) EXPECT_GT(stuck.inside, 0.3) << way_of(stuck);
  if (says_nothing) EXPECT_NEAR(stuck.certificate.volume, 4 * kPi / 3 * 0.488, 0.03);
}

TEST(ClosedMesh, SaysThatHangingSheetsWereLeftOut) {
  TriangleMesh ball = test::sphere_mesh(1, 48, 96).mesh;
  const TriangleMesh leaf =
      test::grid_mesh(2, 2, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
  for (int i = 0; i < 300; ++i) {
    const float angle = 0.7f * static_cast<float>(i);
    ball = joined(
        ball,
        moved(
            leaf, 0.3f, {3 * std::cos(angle), 3 * std::sin(angle), 0.02f * static_cast<float>(i)}));
  }
  const ClosedMesh out = closed_mesh(ball);
  EXPECT_NE(out.attempts[out.taken].reason.find("leaves out"), std::string::npos)
      << way_of(out) << ": " << out.attempts[out.taken].reason;
}

// Faces that hang together nowhere, with gaps between all of them.
TEST(ClosedMesh, ClosesASoupOfLooseFacesWithoutGoingIn) {
  const TriangleMesh ball = test::sphere_mesh(1, 24, 48).mesh;
  TriangleMesh soup;
  for (const auto& f : ball.faces) {
    const Eigen::Vector3f middle =
        (ball.vertices[f[0]] + ball.vertices[f[1]] + ball.vertices[f[2]]) / 3;
    const auto first = static_cast<uint32_t>(soup.vertices.size());
    for (const uint32_t v : f) soup.vertices.push_back(middle + 0.7f * (ball.vertices[v] - middle));
    soup.faces.push_back({first, first + 1, first + 2});
  }
  const ClosedMesh out = closed_mesh(soup);
  EXPECT_EQ(why_no_solid(out.mesh), "");
  EXPECT_EQ(way_of(out), "wrap");
  EXPECT_NEAR(out.certificate.volume / (4 * kPi / 3), 1, 0.05);
  EXPECT_EQ(out.attempts[out.taken].reason, "");
}

TEST(ClosedMesh, MakesAPlateOfASheetAndSaysThatItIsOne) {
  const TriangleMesh sheet =
      test::grid_mesh(20, 20, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
  const ClosedMesh out = closed_mesh(sheet);
  EXPECT_EQ(why_no_solid(out.mesh), "");
  EXPECT_GT(out.certificate.volume, 0);
  EXPECT_LT(out.certificate.volume, 0.02);
  EXPECT_NE(out.attempts[out.taken].reason.find("of its area inside"), std::string::npos)
      << out.attempts[out.taken].reason;
}

TEST(ClosedMesh, GivesTheSameBitsForAnyNumberOfThreads) {
  const TriangleMesh broken = test::damaged(bumpy_ring(), test::Damage::DoubledShells, 2);
  const auto run = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return closed_mesh(broken);
  };
  const ClosedMesh one = run(1);
  const ClosedMesh four = run(4);
  EXPECT_EQ(way_of(one), "level-set");
  EXPECT_EQ(one.mesh.vertices, four.mesh.vertices);
  EXPECT_EQ(one.mesh.faces, four.mesh.faces);
}

TEST(ClosedMesh, RefusesWhatHasNoSurface) {
  EXPECT_THROW(closed_mesh({}), InvalidInput);
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.faces = {{0, 1, 2}};
  EXPECT_THROW(closed_mesh(flat), NumericalError);
}

}  // namespace
}  // namespace cgs::closing_test
