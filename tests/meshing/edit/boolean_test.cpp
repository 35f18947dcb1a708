// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/boolean.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::boolean_test {
namespace {

constexpr double kPi = std::numbers::pi;

TriangleMesh box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  TriangleMesh out = test::cube_mesh(1).mesh;
  for (auto& p : out.vertices) p = low + p.cwiseProduct(high - low);
  return out;
}

TriangleMesh labelled(TriangleMesh mesh, Provenance label, float sigma) {
  mesh.provenance.assign(mesh.faces.size(), label);
  mesh.sigma.assign(mesh.vertices.size(), sigma);
  mesh.support.assign(mesh.vertices.size(), label == Provenance::Observed ? 3.0f : 1.0f);
  return mesh;
}

TriangleMesh ball_at(double x) {
  TriangleMesh out = test::sphere_mesh(1, 64, 128).mesh;
  for (auto& p : out.vertices) p.x() += static_cast<float>(x);
  return out;
}

TEST(Boolean, TwoBoxesHaveTheVolumesOfArithmetic) {
  const TriangleMesh a = box({0, 0, 0}, {2, 2, 2});
  const TriangleMesh b = box({1, 1, 1}, {3, 4, 2.5f});
  const auto volume = [&](BooleanOperation operation) {
    const BooleanResult out = boolean(a, b, operation);
    EXPECT_TRUE(certify(out.mesh).passed());
    EXPECT_EQ(out.self_intersections, 0U);
    return certify(out.mesh).volume;
  };
  EXPECT_NEAR(volume(BooleanOperation::Union), 8 + 9 - 1, 1e-6);
  EXPECT_NEAR(volume(BooleanOperation::Intersection), 1, 1e-6);
  EXPECT_NEAR(volume(BooleanOperation::Difference), 7, 1e-6);
}

TEST(Boolean, TwoBoxesHaveTheVolumesOfArithmeticAtAnyScale) {
  const auto bounds = [](const TriangleMesh& mesh) {
    Eigen::AlignedBox3d out;
    for (const Eigen::Vector3f& p : mesh.vertices) out.extend(p.cast<double>());
    return out;
  };
  for (const float s : {1e-6f, 1e-3f, 1.0f, 1e3f, 1e6f}) {
    const TriangleMesh a = box({0, 0, 0}, {2 * s, 2 * s, 2 * s});
    const TriangleMesh b = box({s, s, s}, {3 * s, 4 * s, 2.5f * s});
    const double common = bounds(a).intersection(bounds(b)).volume();
    const auto ratio = [&](BooleanOperation operation, double expected) {
      return certify(boolean(a, b, operation).mesh).volume / expected;
    };
    const double both = bounds(a).volume() + bounds(b).volume() - common;
    EXPECT_NEAR(ratio(BooleanOperation::Union, both), 1, 1e-12) << s;
    EXPECT_NEAR(ratio(BooleanOperation::Intersection, common), 1, 1e-12) << s;
    EXPECT_NEAR(ratio(BooleanOperation::Difference, bounds(a).volume() - common), 1, 1e-12) << s;
  }
}

TEST(Boolean, FacesInOnePlaneMeetCleanly) {
  const TriangleMesh a = box({0, 0, 0}, {1, 1, 1});
  const TriangleMesh b = box({1, 0, 0}, {2, 1, 1});
  const Certificate both = certify(boolean(a, b, BooleanOperation::Union).mesh);
  EXPECT_TRUE(both.passed());
  EXPECT_EQ(both.components, 1U);
  EXPECT_NEAR(both.volume, 2, 1e-6);
  EXPECT_NEAR(both.area, 10, 1e-6);
  EXPECT_NEAR(certify(boolean(a, a, BooleanOperation::Union).mesh).volume, 1, 1e-6);
  EXPECT_TRUE(boolean(a, a, BooleanOperation::Difference).mesh.faces.empty());
}

TEST(Boolean, DrillsAHoleAndMakesACavity) {
  const TriangleMesh cube = box({0, 0, 0}, {1, 1, 1});
  const Certificate drilled = certify(
      boolean(cube, box({0.25f, 0.25f, -1}, {0.75f, 0.5f, 2}), BooleanOperation::Difference).mesh);
  EXPECT_TRUE(drilled.passed());
  EXPECT_EQ(drilled.genus, 1);
  EXPECT_NEAR(drilled.volume, 1 - 0.125, 1e-6);
  const Certificate hollow = certify(
      boolean(cube, box({0.25f, 0.25f, 0.25f}, {0.5f, 0.5f, 0.5f}), BooleanOperation::Difference)
          .mesh);
  EXPECT_TRUE(hollow.passed());
  EXPECT_EQ(hollow.components, 2U);
  EXPECT_NEAR(hollow.volume, 1 - 1.0 / 64, 1e-6);
}

TEST(Boolean, BallsShareALens) {
  // Two caps of height 1 - d/2, Archimedes.
  constexpr double kApart = 1;
  const double lens = kPi * (4 + kApart) * (2 - kApart) * (2 - kApart) / 12;
  const double ball = 4 * kPi / 3;
  const auto volume = [&](BooleanOperation operation) {
    return certify(boolean(ball_at(0), ball_at(kApart), operation).mesh).volume;
  };
  EXPECT_NEAR(volume(BooleanOperation::Intersection) / lens, 1, 0.004);
  EXPECT_NEAR(volume(BooleanOperation::Union) / (2 * ball - lens), 1, 0.004);
  EXPECT_NEAR(volume(BooleanOperation::Difference) / (ball - lens), 1, 0.004);
  EXPECT_TRUE(boolean(ball_at(0), ball_at(3), BooleanOperation::Intersection).mesh.faces.empty());
  EXPECT_EQ(certify(boolean(ball_at(0), ball_at(3), BooleanOperation::Union).mesh).components, 2U);
}

TEST(Boolean, FacesKeepTheirLabelAndVerticesOnTheCutTheLesserClaim) {
  const TriangleMesh a = labelled(ball_at(0), Provenance::Observed, 0.01f);
  const TriangleMesh b = labelled(ball_at(1), Provenance::SingleView, 0.03f);
  const BooleanResult out = boolean(a, b, BooleanOperation::Difference);
  size_t from_b = 0;
  std::vector<uint8_t> seen(out.mesh.vertices.size(), 0);
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    const bool is_b = out.mesh.provenance[f] == Provenance::SingleView;
    from_b += is_b ? 1 : 0;
    for (const uint32_t v : out.mesh.faces[f]) {
      seen[v] |= is_b ? 2 : 1;
      const Eigen::Vector3f p = out.mesh.vertices[v];
      const float off = is_b ? (p - Eigen::Vector3f(1, 0, 0)).norm() : p.norm();
      EXPECT_NEAR(off, 1, 0.002);
    }
  }
  EXPECT_EQ(from_b, out.from_second);
  EXPECT_GT(from_b, 1000U);
  for (size_t v = 0; v < seen.size(); ++v) {
    EXPECT_NEAR(out.mesh.sigma[v], seen[v] == 1 ? 0.01f : 0.03f, 1e-6f);
    EXPECT_EQ(out.mesh.support[v], seen[v] == 1 ? 3.0f : 1.0f);
  }
}

TEST(Boolean, WhatStatesNothingIsInferred) {
  const TriangleMesh a = labelled(box({0, 0, 0}, {2, 2, 2}), Provenance::Observed, 0.01f);
  const BooleanResult out = boolean(a, box({1, 1, 1}, {3, 4, 2.5f}), BooleanOperation::Union);
  const auto area = area_by_provenance(out.mesh);
  EXPECT_NEAR(area[size_t(Provenance::Observed)], 24 - 3, 1e-5);
  EXPECT_NEAR(area[size_t(Provenance::Inferred)], 2 * (6 + 3 + 4.5) - 3, 1e-5);
}

TEST(WhyNoSolid, SaysWhatIsWrong) {
  TriangleMesh cube = test::cube_mesh(1).mesh;
  EXPECT_EQ(why_no_solid(cube), "");
  TriangleMesh inside_out = cube;
  for (auto& f : inside_out.faces) std::swap(f[0], f[1]);
  EXPECT_NE(why_no_solid(inside_out).find("outside"), std::string::npos);
  TriangleMesh open = cube;
  open.faces.pop_back();
  EXPECT_EQ(why_no_solid(open), "is not closed");
  TriangleMesh crossed = cube;
  for (const auto& p : cube.vertices)
    crossed.vertices.push_back(p + Eigen::Vector3f(0.5f, 0, 0.1f));
  for (const auto& f : cube.faces) crossed.faces.push_back({f[0] + 8, f[1] + 8, f[2] + 8});
  EXPECT_NE(why_no_solid(crossed).find("cuts itself"), std::string::npos);
}

TEST(WhyNoSolid, ShellsWithinShellsMustAlternate) {
  const TriangleMesh outer = box({0, 0, 0}, {4, 4, 4});
  const TriangleMesh inner = box({1, 1, 1}, {3, 3, 3});
  TriangleMesh cavity = inner;
  for (auto& f : cavity.faces) std::swap(f[0], f[1]);
  EXPECT_EQ(why_no_solid(joined(outer, inner)),
            "has shells within shells that disagree on what is outside");
  EXPECT_EQ(why_no_solid(joined(outer, box({5, 0, 0}, {6, 1, 1}))), "");
  TriangleMesh hollow = joined(outer, cavity);
  EXPECT_EQ(why_no_solid(hollow), "");
  EXPECT_EQ(why_no_solid(joined(hollow, box({1.5f, 1.5f, 1.5f}, {2, 2, 2}))), "");
  hollow.vertices.emplace_back(9.0f, 9.0f, 9.0f);  // of no face
  EXPECT_EQ(why_no_solid(hollow), "");
}

}  // namespace
}  // namespace cgs::boolean_test
