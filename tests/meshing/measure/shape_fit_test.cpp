// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/shape_fit.h"

#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/unshared_corners.h"

namespace cgs::shape_fit_test {
namespace {

const Eigen::Quaterniond kTurn(Eigen::AngleAxisd(0.8, Eigen::Vector3d(3, -1, 2).normalized()));

// Moved along its normals by independent errors.
MeasurableMesh noisy(MeasurableMesh mesh,
                     double sigma,
                     uint32_t seed,
                     const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& normal) {
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0, sigma);
  for (Eigen::Vector3d& p : mesh.points) p += error(random) * normal(p);
  return mesh;
}

MeasurableMesh turned(MeasurableMesh mesh) {
  for (Eigen::Vector3d& p : mesh.points) p = kTurn * p + Eigen::Vector3d(0.1, -0.2, 0.3);
  return mesh;
}

Eigen::Vector3d turned(const Eigen::Vector3d& p) {
  return kTurn * p + Eigen::Vector3d(0.1, -0.2, 0.3);
}

TEST(FitShape, PlaneOnTwoTriangles) {
  const MeasurableMesh mesh = turned(test::cube_mesh());
  const ShapeFit fit = fit_shape(mesh, Shape::Plane, turned(Eigen::Vector3d(0.5, 0.5, 1)), 0.3);
  EXPECT_LT((fit.direction - kTurn * Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((fit.point - turned(Eigen::Vector3d(0.5, 0.5, 1))).norm(), 0.01);
  EXPECT_LT(fit.rms, 1e-14);
  EXPECT_NEAR(fit.area.value / (std::numbers::pi * 0.09), 1, 0.02);
}

// A ball in the middle of a face, however much larger that is.
TEST(FitShape, PlaneOnASmallPartOfALargeFace) {
  const MeasurableMesh mesh = test::cube_mesh(1);
  for (const double radius : {0.3, 0.01, 1e-4, 1e-6}) {
    const ShapeFit fit = fit_shape(mesh, Shape::Plane, {0.5, 0.4, 1}, radius);
    EXPECT_NEAR(fit.area.value / (std::numbers::pi * radius * radius), 1, 0.01) << radius;
    EXPECT_NEAR(std::abs(fit.direction.z()), 1, 1e-9) << radius;
  }
}

TEST(FitShape, SphereAndCylinderOfFineMeshes) {
  const auto ball = turned(test::sphere_mesh(0.4, 200, 400));
  const ShapeFit sphere = fit_shape(ball, Shape::Sphere, turned(Eigen::Vector3d(0.4, 0, 0)), 0.3);
  EXPECT_NEAR(sphere.radius.value, 0.4, 1e-4);
  EXPECT_LT((sphere.point - turned(Eigen::Vector3d(0, 0, 0))).norm(), 1e-4);
  const auto tube = turned(test::tube_mesh(0.2, 0.6, 400, 50));
  const ShapeFit cylinder =
      fit_shape(tube, Shape::Cylinder, turned(Eigen::Vector3d(0.2, 0, 0.3)), 0.25);
  EXPECT_NEAR(cylinder.radius.value, 0.2, 1e-4);
  EXPECT_NEAR(std::abs(cylinder.direction.dot(kTurn * Eigen::Vector3d::UnitZ())), 1, 1e-8);
  EXPECT_LT((cylinder.point - turned(Eigen::Vector3d(0, 0, 0)))
                .cross(kTurn * Eigen::Vector3d::UnitZ())
                .norm(),
            1e-4);
}

// Facets cut off from a round shape: its corners have the radius that a caliper would find.
TEST(FitShape, CoarseFacetsAreNoSmallerShape) {
  const MeasurableMesh pin = turned(test::unshared_corners(test::tube_mesh(10, 20, 24, 1)));
  const ShapeFit cylinder = fit_shape(pin, Shape::Cylinder, turned(Eigen::Vector3d(10, 0, 10)), 8);
  EXPECT_NEAR(cylinder.radius.value, 10, 1e-9);
  EXPECT_NEAR(std::abs(cylinder.direction.dot(kTurn * Eigen::Vector3d::UnitZ())), 1, 1e-12);
  const double sagitta = 10 * (1 - std::cos(std::numbers::pi / 24));
  EXPECT_GT(cylinder.largest, 0.8 * sagitta);
  EXPECT_LT(cylinder.largest, 1.01 * sagitta);
  const MeasurableMesh ball = turned(test::sphere_mesh(10, 24, 48));
  const ShapeFit sphere = fit_shape(ball, Shape::Sphere, turned(Eigen::Vector3d(10, 0, 0)), 6);
  EXPECT_NEAR(sphere.radius.value, 10, 1e-9);
  EXPECT_LT((sphere.point - turned(Eigen::Vector3d(0, 0, 0))).norm(), 1e-9);
}

// Its facets end a thousand radii of the ball away.
TEST(FitShape, ALongPipeOfLongFacetsHasItsRadius) {
  const MeasurableMesh pipe = turned(test::tube_mesh(0.005, 10, 48, 1));
  const ShapeFit fit =
      fit_shape(pipe, Shape::Cylinder, turned(Eigen::Vector3d(0.005, 0, 5)), 0.004);
  EXPECT_NEAR(fit.radius.value, 0.005, 1e-9);
  EXPECT_NEAR(std::abs(fit.direction.dot(kTurn * Eigen::Vector3d::UnitZ())), 1, 1e-12);
}

TEST(FitShape, RepeatedVerticesCountOnce) {
  const auto radial = [](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.normalized()); };
  const MeasurableMesh shared = noisy(test::sphere_mesh(0.4, 48, 96), 2e-3, 5, radial);
  const ShapeFit a = fit_shape(shared, Shape::Sphere, {0.4, 0, 0}, 0.2);
  const ShapeFit b = fit_shape(test::unshared_corners(shared), Shape::Sphere, {0.4, 0, 0}, 0.2);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_NEAR(a.radius.value, b.radius.value, 1e-9);
  EXPECT_NEAR(a.radius_scatter / b.radius_scatter, 1, 1e-6);
}

// Areas around vertices differ a hundredfold between the pole and the rim of the patch.
TEST(FitShape, ScatterHoldsForUnequalShares) {
  constexpr int kRuns = 100;
  double squares = 0;
  double stated = 0;
  for (uint32_t run = 0; run < kRuns; ++run) {
    const auto ball =
        noisy(test::sphere_mesh(0.4, 24, 96), 2e-3, run, [](const Eigen::Vector3d& p) {
          return Eigen::Vector3d(p.normalized());
        });
    const ShapeFit fit = fit_shape(ball, Shape::Sphere, {0, 0, 0.4}, 0.3);
    squares += std::pow(fit.radius.value - 0.4, 2);
    stated += fit.radius_scatter;
  }
  const double scatter = std::sqrt(squares / kRuns);
  EXPECT_NEAR(stated / kRuns / scatter, 1, 0.25) << scatter;
}

TEST(FitShape, RadiusHasASigmaOnlyWhereVerticesStateOne) {
  const MeasurableMesh ball = test::sphere_mesh(0.4);
  EXPECT_TRUE(std::isnan(fit_shape(ball, Shape::Sphere, {0.4, 0, 0}, 0.2).radius.sigma));
  const ShapeFit fit = fit_shape(test::with_sigma(ball, 1e-3f), Shape::Sphere, {0.4, 0, 0}, 0.2);
  EXPECT_NEAR(fit.radius.sigma, 1e-3, 1e-6);
  const MeasurableMesh invented = test::with_labels(
      test::with_sigma(ball, 1e-3f), [](const auto&) { return Provenance::Inferred; });
  EXPECT_TRUE(std::isnan(fit_shape(invented, Shape::Sphere, {0.4, 0, 0}, 0.2).radius.sigma));
}

// Monte Carlo: the stated sigma of the radius against the scatter of many fits.
TEST(FitShape, SigmaOfTheRadiusIsItsScatter) {
  constexpr int kRuns = 60;
  double squares = 0;
  double stated = 0;
  for (uint32_t run = 0; run < kRuns; ++run) {
    const auto ball =
        noisy(test::sphere_mesh(0.4, 48, 96), 2e-3, run, [](const Eigen::Vector3d& p) {
          return Eigen::Vector3d(p.normalized());
        });
    const ShapeFit fit = fit_shape(ball, Shape::Sphere, {0.4, 0, 0}, 0.25);
    squares += std::pow(fit.radius.value - 0.4, 2);
    stated += fit.radius_scatter;
    EXPECT_NEAR(fit.rms, 2e-3 * std::sqrt(0.5), 5e-4);  // between vertices errors average
  }
  const double scatter = std::sqrt(squares / kRuns);
  EXPECT_NEAR(stated / kRuns / scatter, 1, 0.5) << scatter;
}

TEST(FitShape, ACommonErrorReachesThePlane) {
  const auto mesh = test::with_sigma(test::cube_mesh(), 5e-3f);
  const ShapeFit fit = fit_shape(mesh, Shape::Plane, {0.5, 0.5, 1}, 0.3);
  EXPECT_NEAR(fit.point_sigma, 5e-3, 1e-6);
  EXPECT_NEAR(fit.area.stated, 1, 1e-12);
}

TEST(FitShape, EveryLabelHasItsPart) {
  for (size_t label = 0; label < kProvenanceCount; ++label) {
    const MeasurableMesh ball = test::with_labels(test::sphere_mesh(0.4), [&](const auto& p) {
      return p.z() > 0 ? static_cast<Provenance>(label) : Provenance::Observed;
    });
    const ShapeFit fit = fit_shape(ball, Shape::Sphere, {0, 0, 0.4}, 0.2);  // above z = 0 only
    EXPECT_DOUBLE_EQ(fit.area.by_provenance.at(label), fit.area.value) << label;
    EXPECT_DOUBLE_EQ(fit.radius.by_provenance.at(label), fit.radius.value) << label;
  }
}

TEST(FitShape, RefusesWhatDeterminesNothing) {
  const MeasurableMesh mesh = test::cube_mesh();
  EXPECT_THROW(fit_shape(mesh, Shape::Sphere, {0.5, 0.5, 1}, 0.3), NumericalError);
  EXPECT_THROW(fit_shape(mesh, Shape::Cylinder, {0.5, 0.5, 1}, 0.3), NumericalError);
  EXPECT_THROW(fit_shape(mesh, Shape::Plane, {5, 5, 5}, 0.3), InvalidInput);
  EXPECT_THROW(fit_shape(mesh, Shape::Plane, {0, 0, 0}, 0), InvalidInput);
}

}  // namespace
}  // namespace cgs::shape_fit_test
