// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/stated_surface.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::stated_surface_test {
namespace {

// The unit square at z = 0 that looks up; observed for x < 0.5, else inferred.
TriangleMesh half_seen_sheet() {
  MeasurableMesh sheet =
      test::grid_mesh(10, 10, [](double s, double t) { return Eigen::Vector3d(s, t, 0); });
  sheet = test::with_labels(sheet, [](const Eigen::Vector3d& p) {
    return p.x() < 0.5 ? Provenance::Observed : Provenance::Inferred;
  });
  sheet.mesh.sigma.assign(sheet.points.size(), 0.03f);
  return sheet.mesh;
}

// A triangle with its first corner at a place, about as large as it is told.
TriangleMesh triangle(const Eigen::Vector3f& at, float size, bool looks_up = true) {
  TriangleMesh out;
  out.vertices = {at, at + Eigen::Vector3f(size, 0, 0), at + Eigen::Vector3f(0, size, 0)};
  out.faces = {{0, 1, 2}};
  if (!looks_up) std::swap(out.faces[0][0], out.faces[0][1]);
  return out;
}

TEST(TakeEvidence, AFaceTakesTheWeakestLabelUnderIt) {
  const TriangleMesh sheet = half_seen_sheet();
  const StatedSurface source(sheet);
  const auto label = [&](TriangleMesh face) {
    take_evidence(face, source, 0.1);
    return face.provenance.at(0);
  };
  EXPECT_EQ(label(triangle({0.2f, 0.2f, 0.05f}, 0.1f)), Provenance::Observed);
  EXPECT_EQ(label(triangle({0.4f, 0.2f, 0.05f}, 0.3f)), Provenance::Inferred);  // across
  EXPECT_EQ(label(triangle({0.2f, 0.2f, 0.15f}, 0.1f)), Provenance::Inferred);  // too far
  EXPECT_EQ(label(triangle({-0.3f, 0.2f, 0}, 0.35f)), Provenance::Inferred);    // beyond the rim
  EXPECT_EQ(label(triangle({0.2f, 0.2f, -0.05f}, 0.1f, false)), Provenance::Inferred);  // back
}

TEST(TakeEvidence, TellsBridgesFromBacks) {
  const TriangleMesh sheet = half_seen_sheet();
  const StatedSurface source(sheet);
  TriangleMesh back = triangle({0.2f, 0.2f, -0.05f}, 0.1f, false);
  const EvidenceTransfer behind = take_evidence(back, source, 0.1);
  EXPECT_NEAR(behind.area, 0.005, 1e-7);
  EXPECT_NEAR(behind.behind, 0.005, 1e-7);
  EXPECT_EQ(behind.bridged, 0);
  TriangleMesh far = triangle({0.2f, 0.2f, 0.2f}, 0.1f);
  const EvidenceTransfer bridge = take_evidence(far, source, 0.1);
  EXPECT_NEAR(bridge.bridged, 0.005, 1e-7);
  EXPECT_EQ(bridge.behind, 0);
}

TEST(TakeEvidence, SigmaGrowsWithTheDistanceAndGoesWithTheLabel) {
  const TriangleMesh sheet = half_seen_sheet();
  const StatedSurface source(sheet);
  TriangleMesh near = triangle({0.2f, 0.2f, 0.04f}, 0.1f);
  take_evidence(near, source, 0.1);
  for (const float s : near.sigma) EXPECT_NEAR(s, 0.05f, 1e-6f);
  TriangleMesh far = triangle({0.2f, 0.2f, 0.2f}, 0.1f);
  take_evidence(far, source, 0.1);
  for (const float s : far.sigma) EXPECT_TRUE(std::isnan(s));
}

TEST(TakeEvidence, BridgesStateNothingOfASourceWithoutLabels) {
  TriangleMesh sheet = half_seen_sheet();
  sheet.provenance.clear();
  sheet.support.assign(sheet.vertices.size(), 3);
  const StatedSurface source(sheet);
  const auto expect_nothing = [&](TriangleMesh face) {
    take_evidence(face, source, 0.1);
    EXPECT_TRUE(face.provenance.empty());
    EXPECT_EQ(face.sigma.size(), 3U);
    for (const float s : face.sigma) EXPECT_TRUE(std::isnan(s));
    for (const float s : face.support) EXPECT_EQ(s, 0);
  };
  expect_nothing(triangle({0.2f, 0.2f, 0.2f}, 0.1f));
  expect_nothing(triangle({0.2f, 0.2f, -0.05f}, 0.1f, false));
  TriangleMesh near = triangle({0.2f, 0.2f, 0.04f}, 0.1f);
  take_evidence(near, source, 0.1);
  for (const float s : near.sigma) EXPECT_NEAR(s, 0.05f, 1e-6f);
  for (const float s : near.support) EXPECT_EQ(s, 3);
}

// 3 x 3 points at z = 0, seen from above by three views.
TriangleMesh points_that_look_up(float length) {
  TriangleMesh out;
  for (const float y : {0.0f, 1.0f, 2.0f}) {
    for (const float x : {0.0f, 1.0f, 2.0f}) out.vertices.emplace_back(x, y, 0.0f);
  }
  out.normals.assign(9, Eigen::Vector3f(0, 0, length));
  out.support.assign(9, 3);
  return out;
}

TEST(TakeEvidence, NobodyKnowsTheBackOfAPointWithoutNormal) {
  TriangleMesh cloud = points_that_look_up(1);
  cloud.normals[4] = Eigen::Vector3f::Zero();  // (1, 1, 0)
  const StatedSurface source(cloud);
  for (const bool looks_up : {true, false}) {
    TriangleMesh face = triangle({1, 1, 0.01f}, 0.1f, looks_up);
    EXPECT_EQ(take_evidence(face, source, 0.3).behind, 0);
    EXPECT_EQ(face.provenance.at(0), Provenance::Observed);
    face = triangle({0, 0, 0.01f}, 0.1f, looks_up);
    EXPECT_EQ(take_evidence(face, source, 0.3).behind > 0, !looks_up);
  }
}

TEST(TakeEvidence, WhatIsNotStatedStaysSo) {
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  TriangleMesh face = triangle({0.2f, 0.2f, 1.01f}, 0.1f);
  take_evidence(face, StatedSurface(cube), 0.1);
  EXPECT_TRUE(face.provenance.empty() && face.sigma.empty() && face.support.empty() &&
              face.normals.empty() && face.colors.empty());
}

TEST(StatedSurface, PointsAreLabelledByTheirSupport) {
  TriangleMesh cloud;
  cloud.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_FALSE(StatedSurface(cloud).states_provenance());
  cloud.support = {0, 1, 2};
  const StatedSurface source(cloud);
  EXPECT_EQ(source.nearest({0.1, 0, 0}).label, Provenance::Inferred);
  EXPECT_EQ(source.nearest({0.9, 0, 0}).label, Provenance::SingleView);
  EXPECT_EQ(source.nearest({5, 0, 0}).label, Provenance::Observed);
  EXPECT_THROW(StatedSurface(TriangleMesh{}), InvalidInput);
}

TEST(StatedSurface, NormalsHaveUnitLengthWhateverTheFileSays) {
  const TriangleMesh cloud = points_that_look_up(3);
  const StatedSurface source(cloud);
  EXPECT_TRUE(source.knows_sides());
  EXPECT_LT((source.nearest({1, 1, 0.2}).normal - Eigen::Vector3d::UnitZ()).norm(), 1e-6);
}

TEST(StatedSurface, NormalsThatAreAllZeroAreNone) {
  const TriangleMesh cloud = points_that_look_up(0);
  const StatedSurface source(cloud);
  EXPECT_FALSE(source.knows_sides());
  EXPECT_NEAR(std::abs(source.nearest({1, 1, 0.2}).normal.z()), 1, 1e-6);  // estimated
  TriangleMesh below = triangle({1, 1, -0.01f}, 0.1f, false);
  EXPECT_EQ(take_evidence(below, source, 0.3).behind, 0);
  EXPECT_TRUE(below.normals.empty());
}

TEST(PointSpacing, OfAGrid) {
  std::vector<Eigen::Vector3f> grid;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) grid.emplace_back(0.5f * float(i), 0.5f * float(j), 3.0f);
  }
  // Four neighbours at the side and two at the diagonal of a square.
  EXPECT_NEAR(point_spacing(grid), 0.5 * (4 + 2 * std::sqrt(2.0)) / 6, 1e-5);
  EXPECT_EQ(point_spacing({}), 0);
}

}  // namespace
}  // namespace cgs::stated_surface_test
