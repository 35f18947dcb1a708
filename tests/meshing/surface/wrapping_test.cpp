// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/wrapping.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/mesh_distance.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::wrapping_test {
namespace {

constexpr double kPi = std::numbers::pi;

// A ball of radius 1 whose faces are all observed, but for those within an angle of +z.
TriangleMesh ball_with_hole(double angle) {
  MeasurableMesh ball = test::sphere_mesh(1, 96, 192);
  ball.mesh.provenance.assign(ball.mesh.faces.size(), Provenance::Observed);
  ball.mesh.sigma.assign(ball.points.size(), 0.01f);
  std::vector<uint8_t> keep;
  for (const auto& f : ball.mesh.faces) {
    const Eigen::Vector3d middle = (ball.points[f[0]] + ball.points[f[1]] + ball.points[f[2]]) / 3;
    keep.push_back(middle.normalized().z() < std::cos(angle) ? 1 : 0);
  }
  return with_faces(ball.mesh, keep);
}

Eigen::Vector3d middle_of(const TriangleMesh& mesh, size_t f) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t v : mesh.faces[f]) sum += mesh.vertices[v].cast<double>() / 3;
  return sum;
}

TEST(Wrapped, IsClosedAndAsLargeAsTheInput) {
  const TriangleMesh ball = test::sphere_mesh(1, 96, 192).mesh;
  for (const double alpha : {0.1, 0.2, 0.4}) {
    const double offset = alpha / 30;
    const WrappedMesh out = wrapped(ball, {alpha, offset});
    EXPECT_TRUE(certify(out.mesh).passed()) << alpha;
    EXPECT_EQ(certify(out.mesh).euler_number, 2);
    // At the offset it would be too large by up to 3 offsets: by 1, 2 and 4 %.
    EXPECT_NEAR(out.volume / (4 * kPi / 3), 1, 0.15 * 3 * offset) << alpha;
    EXPECT_LT(mesh_distance(out.mesh, ball, 20'000).hausdorff(), 1.5 * offset) << alpha;
    EXPECT_LT(out.evidence.behind + out.evidence.bridged, 1e-9);
  }
}

TEST(Wrapped, KeepsTheHandleOfATorusAndTheSizeOfABox) {
  const WrappedMesh torus = wrapped(test::torus_mesh(1, 0.3).mesh, {0.15, 0.005});
  const Certificate of_torus = certify(torus.mesh);
  EXPECT_TRUE(of_torus.passed());
  EXPECT_EQ(of_torus.euler_number, 0);
  EXPECT_NEAR(of_torus.volume / (2 * kPi * kPi * 0.09), 1, 0.015);
  EXPECT_NEAR(of_torus.area / (4 * kPi * kPi * 0.3), 1, 0.015);
  const WrappedMesh box = wrapped(test::cube_mesh(1).mesh, {0.1, 0.003});
  EXPECT_TRUE(certify(box.mesh).passed());
  EXPECT_NEAR(box.volume, 1, 0.003);  // at the offset: 1.018
  EXPECT_NEAR(certify(box.mesh).area, 6, 0.02);
}

TEST(Wrapped, InventsExactlyWhatCoversAHole) {
  constexpr double kHole = 0.15;  // radius, seen from the centre of a ball of radius 1
  const TriangleMesh open = ball_with_hole(kHole);
  const double ball = 4 * kPi / 3;
  const double cap = kPi / 3 * std::pow(1 - std::cos(kHole), 2) * (2 + std::cos(kHole));
  for (const double alpha : {0.2, 0.3, 0.5}) {
    const double offset = alpha / 30;
    const WrappedMesh out = wrapped(open, {alpha, offset});
    EXPECT_TRUE(certify(out.mesh).passed()) << alpha;
    EXPECT_NEAR(out.input_volume, ball - cap, 0.004) << alpha;
    EXPECT_NEAR(out.volume, ball - cap, 0.15 * 3 * offset * ball) << alpha;
    double away = 0;  // invented though the input is there
    double over = 0;  // of the hole, said to be observed
    for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
      const auto& [a, b, c] = out.mesh.faces[f];
      const double area = (out.mesh.vertices[b] - out.mesh.vertices[a])
                              .cross(out.mesh.vertices[c] - out.mesh.vertices[a])
                              .norm() /
                          2;
      const double angle = std::acos(middle_of(out.mesh, f).normalized().z());
      const bool invented = out.mesh.provenance[f] == Provenance::Inferred;
      if (invented && angle > kHole + 2 * alpha) away += area;
      if (!invented && angle < kHole - 2 * offset - 0.02) over += area;
    }
    EXPECT_EQ(away, 0) << alpha;
    EXPECT_EQ(over, 0) << alpha;
    EXPECT_GT(out.evidence.bridged, 0.5 * kPi * kHole * kHole);
    EXPECT_LT(out.evidence.bridged, kPi * std::pow(kHole + alpha, 2));
    EXPECT_LT(out.evidence.behind, 0.001);
  }
}

TEST(Wrapped, SaysThatItWentInThroughAHoleWiderThanTheBall) {
  const TriangleMesh open = ball_with_hole(0.5);
  const WrappedMesh in = wrapped(open, {0.15, 0.005});
  EXPECT_TRUE(certify(in.mesh).closed);
  EXPECT_LT(in.volume, 0.5);  // of 4.1
  EXPECT_NEAR(in.evidence.behind / in.evidence.area, 0.5, 0.03);
  for (size_t f = 0; f < in.mesh.faces.size(); ++f) {
    const auto& [a, b, c] = in.mesh.faces[f];
    const Eigen::Vector3f area = (in.mesh.vertices[b] - in.mesh.vertices[a])
                                     .cross(in.mesh.vertices[c] - in.mesh.vertices[a]);
    const bool inside = area.dot(in.mesh.vertices[a]) < 0;  // the back, which nobody saw
    if (inside) EXPECT_EQ(in.mesh.provenance[f], Provenance::Inferred) << f;
  }
  const WrappedMesh over = wrapped(open, {0.6, 0.02});
  EXPECT_GT(over.volume, 3.5);
  EXPECT_LT(over.evidence.behind, 0.01 * over.evidence.area);
}

TEST(Wrapped, VerticesStateTheSigmaOfTheSurfaceAndHowFarTheyAreFromIt) {
  const TriangleMesh open = ball_with_hole(0.3);
  const WrappedMesh out = wrapped(open, {0.4, 0.02});
  size_t sure = 0;
  size_t unsure = 0;
  for (size_t v = 0; v < out.mesh.vertices.size(); ++v) {
    const float sigma = out.mesh.sigma[v];
    if (std::isnan(sigma)) {
      ++unsure;
    } else {
      ++sure;
      EXPECT_GE(sigma, 0.01f * (1 - 1e-5f));
      const double off = std::abs(out.mesh.vertices[v].cast<double>().norm() - 1);
      EXPECT_NEAR(sigma, std::hypot(0.01, off), 0.002);
    }
  }
  EXPECT_GT(sure, 100U);
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    if (out.mesh.provenance[f] == Provenance::Inferred) continue;
    for (const uint32_t v : out.mesh.faces[f]) EXPECT_FALSE(std::isnan(out.mesh.sigma[v]));
  }
}

TEST(Wrapped, TakesPointsWithAndWithoutNormals) {
  MeasurableMesh ball = test::sphere_mesh(1, 60, 120);
  TriangleMesh cloud;
  cloud.vertices = ball.mesh.vertices;
  cloud.support.assign(cloud.vertices.size(), 1);
  for (size_t v = 0; v < cloud.support.size(); ++v) {
    if (cloud.vertices[v].z() > 0) cloud.support[v] = 3;
  }
  const WrappedMesh bare = wrapped(cloud, {0.3, 0.02});
  EXPECT_FALSE(bare.knows_sides);
  EXPECT_TRUE(certify(bare.mesh).passed());
  EXPECT_NEAR(bare.volume / (4 * kPi / 3), 1, 0.01);
  cloud.normals = cloud.vertices;
  const WrappedMesh out = wrapped(cloud, {0.3, 0.02});
  EXPECT_TRUE(out.knows_sides);
  EXPECT_LT(out.evidence.behind, 1e-9);
  EXPECT_NEAR(out.volume / (4 * kPi / 3), 1, 0.01);
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    const double z = middle_of(out.mesh, f).z();
    if (z > 0.15) EXPECT_EQ(out.mesh.provenance[f], Provenance::Observed);
    if (z < -0.15) EXPECT_EQ(out.mesh.provenance[f], Provenance::SingleView);
  }
}

TEST(Wrapped, TakesNormalsOfAnyLengthAndNoneForZeros) {
  TriangleMesh cloud;
  cloud.vertices = test::sphere_mesh(1, 60, 120).mesh.vertices;
  for (const auto& p : cloud.vertices) cloud.normals.emplace_back(5 * p);
  const WrappedMesh sided = wrapped(cloud, {0.3, 0.02});
  EXPECT_TRUE(sided.knows_sides);
  EXPECT_NEAR(sided.volume / (4 * kPi / 3), 1, 0.01);
  cloud.normals.assign(cloud.vertices.size(), Eigen::Vector3f::Zero());
  const WrappedMesh bare = wrapped(cloud, {0.3, 0.02});
  EXPECT_FALSE(bare.knows_sides);
  EXPECT_EQ(bare.evidence.behind, 0);
  EXPECT_NEAR(bare.volume / (4 * kPi / 3), 1, 0.01);
}

// As other programs write it: support and sigma, but no labels.
TEST(Wrapped, ItsBackStatesNothingWithoutLabelsEither) {
  TriangleMesh open = ball_with_hole(0.5);
  open.provenance.clear();
  open.support.assign(open.vertices.size(), 3);
  const WrappedMesh out = wrapped(open, {0.15, 0.005});
  EXPECT_TRUE(out.mesh.provenance.empty());
  std::vector<uint8_t> looks_in(out.mesh.vertices.size(), 1);
  std::vector<uint8_t> looks_out(out.mesh.vertices.size(), 1);
  for (const auto& [a, b, c] : out.mesh.faces) {
    const Eigen::Vector3f area = (out.mesh.vertices[b] - out.mesh.vertices[a])
                                     .cross(out.mesh.vertices[c] - out.mesh.vertices[a]);
    const bool inward = area.dot(out.mesh.vertices[a]) < 0;
    for (const uint32_t v : {a, b, c}) (inward ? looks_out : looks_in)[v] = 0;
  }
  size_t invented = 0;
  size_t known = 0;
  for (size_t v = 0; v < out.mesh.vertices.size(); ++v) {
    if (out.mesh.vertices[v].z() > 0) continue;  // the hole and its rim
    if (looks_in[v] != 0) {
      ++invented;
      EXPECT_TRUE(std::isnan(out.mesh.sigma[v])) << v;
      EXPECT_EQ(out.mesh.support[v], 0) << v;
    } else if (looks_out[v] != 0 && !std::isnan(out.mesh.sigma[v])) {
      ++known;
      EXPECT_EQ(out.mesh.support[v], 3) << v;
    }
  }
  EXPECT_GT(invented, 100U);
  EXPECT_GT(known, 100U);
}

TEST(Wrapped, KeepsTheTwoSidesOfASheetApart) {
  const TriangleMesh sheet =
      test::grid_mesh(10, 10, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
  const WrappedMesh out = wrapped(sheet, {0.1, 0.004});
  EXPECT_TRUE(certify(out.mesh).passed());
  EXPECT_GT(out.volume, 0);
  EXPECT_LT(out.volume, 0.008);
  EXPECT_NEAR(out.evidence.behind / out.evidence.area, 0.5, 0.05);
  EXPECT_TRUE(out.mesh.provenance.empty());
}

TEST(Wrapped, KnowsNoVolumeOfWhatDoesNotKnowItsInside) {
  TriangleMesh cube = test::cube_mesh(1).mesh;
  EXPECT_NEAR(wrapped(cube, {0.2, 0.01}).input_volume, 1, 1e-6);
  std::swap(cube.faces[3][0], cube.faces[3][1]);
  EXPECT_TRUE(std::isnan(wrapped(cube, {0.2, 0.01}).input_volume));
}

TEST(Wrapped, RefusesWhatIsOutOfRange) {
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  EXPECT_THROW(wrapped(cube, {0, 0.1}), InvalidInput);
  EXPECT_THROW(wrapped(cube, {0.1, 0.2}), InvalidInput);
  EXPECT_THROW(wrapped(cube, {0.1, 1e-6}), InvalidInput);
  EXPECT_THROW(wrapped(cube, {0.0001, 0.0001}), LimitError);
  EXPECT_THROW(wrapped({}, {0.1, 0.01}), InvalidInput);
}

}  // namespace
}  // namespace cgs::wrapping_test
