// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/nearest_surface.h"

#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/unshared_corners.h"

namespace cgs::nearest_surface_test {
namespace {

// Distance to the cube [0, 1]^3, negative inside.
double cube_distance(const Eigen::Vector3d& p) {
  const Eigen::Vector3d q = (p.array() - 0.5).abs() - 0.5;
  return q.cwiseMax(0).norm() + std::min(0.0, q.maxCoeff());
}

MeasurableMesh sharp_tip() {
  MeasurableMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0.05, 0}, {1, -0.05, 0.05}, {1, -0.05, -0.05}};
  mesh.mesh.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return test::with_vertices(std::move(mesh));
}

TEST(NearestSurface, SignedDistanceToACube) {
  const MeasurableMesh mesh = test::cube_mesh();
  const NearestSurface surface(mesh);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1, 2);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d p(place(random), place(random), place(random));
    const SurfacePoint nearest = surface.nearest(p);
    EXPECT_NEAR(surface.signed_distance(p, nearest), cube_distance(p), 1e-14);
    EXPECT_NEAR(nearest.weights.sum(), 1, 1e-14);
    EXPECT_GE(nearest.weights.minCoeff(), 0);
  }
}

TEST(NearestSurface, WithinADistanceFindsTheSameOrNothing) {
  const MeasurableMesh ball = test::sphere_mesh(0.3);
  const NearestSurface surface(ball);
  for (const double x : {0.0, 0.1, 0.31, 0.8}) {
    const Eigen::Vector3d p(x, 0.2 * x, 0.05);
    const SurfacePoint nearest = surface.nearest(p);
    const double distance = (nearest.position - p).norm();
    EXPECT_FALSE(surface.nearest_within(p, distance * (1 - 1e-9)));
    const auto found = surface.nearest_within(p, distance * (1 + 1e-9));
    ASSERT_TRUE(found);
    EXPECT_NEAR((found->position - p).norm(), distance, 1e-12);
  }
}

// At a sharp tip the nearest faces look away from points that lie outside of them.
TEST(NearestSurface, SignNearASharpTip) {
  const MeasurableMesh mesh = sharp_tip();
  const NearestSurface surface(mesh);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-0.3, 0.3);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p(-0.01 - std::abs(place(random)), place(random), place(random));
    EXPECT_GT(surface.signed_distance(p, surface.nearest(p)), 0);
  }
}

TEST(NearestSurface, FacesWithTheirOwnVerticesGiveTheSameSigns) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1, 2);
  for (const MeasurableMesh& mesh : {sharp_tip(), test::cube_mesh()}) {
    const MeasurableMesh loose = test::unshared_corners(mesh);
    const NearestSurface joined(mesh);
    const NearestSurface unjoined(loose);
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Vector3d p(place(random), place(random), place(random));
      EXPECT_EQ(unjoined.signed_distance(p, unjoined.nearest(p)),
                joined.signed_distance(p, joined.nearest(p)))
          << p.transpose();
    }
  }
}

TEST(NearestSurface, KnowsItsRimWhetherFacesShareVerticesOrNot) {
  const auto square =
      test::grid_mesh(4, 4, [](double s, double t) { return Eigen::Vector3d(s, t, 0); });
  for (const MeasurableMesh& mesh : {square, test::unshared_corners(square)}) {
    const NearestSurface surface(mesh);
    const auto is_on_rim = [&](const Eigen::Vector3d& p) {
      return surface.is_on_rim(surface.nearest(p));
    };
    const auto is_beyond = [&](const Eigen::Vector3d& p) {
      return surface.is_beyond_rim(p, surface.nearest(p));
    };
    EXPECT_TRUE(has_rim(mesh));
    for (const double z : {-0.3, 0.0, 0.3}) {
      EXPECT_FALSE(is_on_rim({0.25, 0.4, z}));  // an edge within
      EXPECT_FALSE(is_on_rim({0.5, 0.5, z}));   // a vertex within
      EXPECT_TRUE(is_on_rim({1, 0.4, z}));
      EXPECT_TRUE(is_on_rim({0, 1, z}));
      EXPECT_FALSE(is_beyond({1, 0.4, z}));
      EXPECT_FALSE(is_beyond({0, 1, z}));
      EXPECT_TRUE(is_beyond({1.1, 0.4, z}));
      EXPECT_TRUE(is_beyond({1.1, 0.5, z}));  // beside a vertex of a straight rim
      EXPECT_TRUE(is_beyond({-0.1, 1.1, z}));
      EXPECT_FALSE(is_beyond({0.9, 0.4, z}));
    }
  }
}

// A slit along the edge from 0 to 1 is closed by a face without area.
TEST(NearestSurface, ClosedMeshesHaveNoRim) {
  MeasurableMesh slit = test::cube_mesh();
  slit.points.emplace_back(0.5, 0, 0);
  slit.mesh.faces[0] = {0, 2, 8};
  slit.mesh.faces.push_back({8, 2, 1});
  EXPECT_TRUE(has_rim(slit));
  slit.mesh.faces.push_back({0, 8, 1});
  for (const MeasurableMesh& mesh : {test::cube_mesh(),
                                     test::unshared_corners(test::cube_mesh()),
                                     slit,
                                     test::unshared_corners(slit)}) {
    EXPECT_FALSE(has_rim(mesh));
    const NearestSurface surface(mesh);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.3, -1, -1),
                                     Eigen::Vector3d(-1, -1, -1),
                                     Eigen::Vector3d(0.5, -0.1, -0.2),
                                     Eigen::Vector3d(0.5, 2, 0.5)}) {
      EXPECT_FALSE(surface.is_on_rim(surface.nearest(p))) << p.transpose();
      EXPECT_FALSE(surface.is_beyond_rim(p, surface.nearest(p))) << p.transpose();
    }
  }
}

TEST(NearestSurface, IgnoresFacesWithoutAreaAndNeedsOneWith) {
  MeasurableMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}};
  mesh.mesh.faces = {{0, 1, 2}};
  EXPECT_THROW(NearestSurface{mesh}, InvalidInput);
  mesh.mesh.faces.push_back({0, 1, 3});
  EXPECT_EQ(NearestSurface(mesh).nearest({0.2, 0.2, 1}).face, 1U);
}

TEST(EvidenceAt, InterpolatesSigma) {
  MeasurableMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.mesh.faces = {{0, 1, 2}};
  EXPECT_TRUE(std::isnan(evidence_at(mesh, {0, {0, 0, 0}, {1, 0, 0}}).sigma));
  mesh.mesh.sigma = {0.25f, 0.5f, NAN};
  mesh.mesh.provenance = {Provenance::SingleView};
  const SurfaceEvidence at = evidence_at(mesh, {0, {0.5, 0, 0}, {0.5, 0.5, 0}});
  EXPECT_EQ(at.sigma, 0.375);
  EXPECT_EQ(at.provenance, Provenance::SingleView);
  EXPECT_EQ(at.normal, Eigen::Vector3d(0, 0, 1));
  for (const Provenance label : {Provenance::Inferred, Provenance::Estimated}) {
    mesh.mesh.provenance = {label};
    EXPECT_TRUE(std::isnan(evidence_at(mesh, {0, {0.5, 0, 0}, {0.5, 0.5, 0}}).sigma));
  }
}

}  // namespace
}  // namespace cgs::nearest_surface_test
