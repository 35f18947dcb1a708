// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/geodesic.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::geodesic_test {
namespace {

SurfacePath between(const MeasurableMesh& mesh,
                    const Eigen::Vector3d& a,
                    const Eigen::Vector3d& b) {
  const NearestSurface surface(mesh);
  return distance_along(mesh, surface.nearest(a), surface.nearest(b));
}

TEST(DistanceAlong, UnfoldsACube) {
  const MeasurableMesh mesh = test::cube_mesh();
  // Opposite corners: over two faces unfolded to 1 x 2.
  EXPECT_NEAR(between(mesh, {0, 0, 0}, {1, 1, 1}).length.value, std::sqrt(5), 1e-12);
  // The middles of opposite faces: half, whole, half.
  EXPECT_NEAR(between(mesh, {0.5, 0.5, 0}, {0.5, 0.5, 1}).length.value, 2, 1e-12);
  const SurfacePath flat = between(mesh, {0.1, 0.2, 0}, {0.7, 0.6, 0});
  EXPECT_NEAR(flat.length.value, std::hypot(0.6, 0.4), 1e-12);
  EXPECT_TRUE(flat.exact);
}

TEST(DistanceAlong, GoesRoundASphereAndATube) {
  const auto ball = test::sphere_mesh(0.4, 64, 128);
  const Eigen::Vector3d a(0.4, 0, 0);
  const Eigen::Vector3d b = 0.4 * Eigen::Vector3d(0.1, 0.9, 0.6).normalized();
  EXPECT_NEAR(between(ball, a, b).length.value, 0.4 * std::acos(a.dot(b) / 0.16), 1e-3);
  // A helix on a prism of 96 sides: unroll it.
  const auto tube = test::tube_mesh(0.2, 0.6);
  const double side = 2 * 0.2 * std::sin(std::numbers::pi / 96);
  const SurfacePath helix = between(tube, {0.2, 0, 0.1}, {0, 0.2, 0.5});
  EXPECT_NEAR(helix.length.value, std::hypot(24 * side, 0.4), 1e-9);
}

// As a texture leaves it: no face beside the seam names a vertex of the other side.
TEST(DistanceAlong, CrossesASeamWhoseVerticesAreDoubled) {
  const double turn = 2 * std::numbers::pi;
  const MeasurableMesh tube = test::grid_mesh(96, 24, [&](double s, double t) {
    const double angle = s == 1 ? 0 : turn * s;
    return Eigen::Vector3d(0.2 * std::cos(angle), 0.2 * std::sin(angle), 0.6 * t);
  });
  const double side = 2 * 0.2 * std::sin(std::numbers::pi / 96);
  const double x = 0.2 * std::cos(turn * 10 / 96);
  const double y = 0.2 * std::sin(turn * 10 / 96);
  const SurfacePath path = between(tube, {x, y, 0.3}, {x, -y, 0.4});
  EXPECT_TRUE(path.exact);
  EXPECT_NEAR(path.length.value, std::hypot(20 * side, 0.1), 1e-9);
}

TEST(DistanceAlong, IsTheSameFromEitherEndOnEdgesToo) {
  const MeasurableMesh cube = test::cube_mesh();
  const auto both_ways = [](const MeasurableMesh& mesh, const auto& a, const auto& b) {
    const double there = between(mesh, a, b).length.value;
    EXPECT_NEAR(between(mesh, b, a).length.value, there, 1e-6 * there);
    return there;
  };
  using Point = Eigen::Vector3d;
  // Over the bottom, unfolded.
  EXPECT_NEAR(
      both_ways(cube, Point(0, 0.7, 0.2), Point(1, 0, 0.1)), std::hypot(0.2 + 1, 0.7 + 0.1), 1e-6);
  EXPECT_NEAR(
      both_ways(cube, Point(0, 0.7, 0.2), Point(0.5, 0, 0)), std::hypot(0.2 + 0.5, 0.7), 1e-6);
  const MeasurableMesh torus = test::torus_mesh(0.3, 0.1, 24, 16);
  for (uint32_t f = 7; f < torus.mesh.faces.size(); f += 61) {
    const auto& face = torus.mesh.faces[f];
    const Point on_edge = 0.7 * torus.points[face[0]] + 0.3 * torus.points[face[1]];
    both_ways(torus, Point(0.4, 0.013, 0.004), on_edge);
  }
}

TEST(DistanceAlong, SplitsByLabelAndCarriesSigma) {
  const auto mesh =
      test::with_labels(test::with_sigma(test::cube_mesh(), 1e-3f), [](const Eigen::Vector3d& p) {
        return p.z() < 1e-9 ? Provenance::Inferred : Provenance::Observed;
      });
  const SurfacePath path = between(mesh, {0.5, 0.5, 0}, {0.5, 0.5, 1});
  EXPECT_NEAR(path.length.by_provenance[0], 0.5, 1e-9);
  EXPECT_NEAR(path.length.by_provenance[2], 1.5, 1e-9);
  EXPECT_GT(path.length.sigma, 1e-3);
  EXPECT_LT(path.length.sigma, 1e-2);
}

TEST(DistanceAlong, SaysWhenPartsDoNotHangTogether) {
  MeasurableMesh mesh = test::cube_mesh();
  for (int i = 0; i < 3; ++i) mesh.points.emplace_back(3 + i % 2, 3 + i / 2, 0);
  mesh.mesh.faces.push_back({8, 9, 10});
  EXPECT_THROW(between(mesh, {0, 0, 0}, {3, 3, 0}), InvalidInput);
}

TEST(DistanceAlong, CopesWithThreeFacesAtAnEdgeAndOppositeWindings) {
  MeasurableMesh mesh;
  mesh.points = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}};
  mesh.mesh.faces = {{0, 2, 1}, {0, 3, 1}, {0, 4, 1}};
  // Cut along the shared edge, there is only the way along edges.
  const SurfacePath path = between(mesh, {0.5, 0.25, 0}, {-0.5, 0.25, 0});
  EXPECT_FALSE(path.exact);
  EXPECT_GE(path.length.value, 1);
  EXPECT_LT(path.length.value, 1.2);
}

}  // namespace
}  // namespace cgs::geodesic_test
