// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/surface_measures.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::surface_measures_test {
namespace {

constexpr double kPi = std::numbers::pi;

MeasurableMesh moved(MeasurableMesh mesh, const Eigen::Vector3d& by) {
  for (Eigen::Vector3d& p : mesh.points) p += by;
  return mesh;
}

TEST(SurfaceArea, OfACubeIsExactAndOfRoundSolidsConverges) {
  EXPECT_DOUBLE_EQ(surface_area(test::cube_mesh(0.5)).value, 1.5);
  EXPECT_NEAR(surface_area(test::sphere_mesh(0.4, 200, 400)).value / (4 * kPi * 0.16), 1, 2e-4);
  EXPECT_NEAR(surface_area(test::torus_mesh(0.3, 0.1)).value / (4 * kPi * kPi * 0.03), 1, 1e-3);
  EXPECT_NEAR(surface_area(test::tube_mesh(0.2, 0.6)).value,
              0.6 * 2 * 96 * 0.2 * std::sin(kPi / 96),
              1e-12);
}

TEST(EnclosedVolume, OfSolids) {
  EXPECT_DOUBLE_EQ(enclosed_volume(test::cube_mesh(0.5)).value, 0.125);
  EXPECT_NEAR(
      enclosed_volume(test::sphere_mesh(0.4, 200, 400)).value / (4 * kPi * 0.064 / 3), 1, 3e-4);
  EXPECT_NEAR(enclosed_volume(test::torus_mesh(0.3, 0.1)).value / (2 * kPi * kPi * 0.003), 1, 3e-3);
}

TEST(EnclosedVolume, TheSameFromAnyPlace) {
  // Powers of two keep the coordinates themselves exact, so that only the sums are tested.
  for (const MeasurableMesh& mesh : {test::cube_mesh(0.5), test::torus_mesh(0.3, 0.1)}) {
    const Eigen::Vector3d far(4194304, -524288, 128);
    MeasurableMesh rounded = mesh;
    for (Eigen::Vector3d& p : rounded.points)
      p = moved(mesh, far).points[size_t(&p - rounded.points.data())] - far;
    const MeasurableMesh there = moved(rounded, far);
    EXPECT_NEAR(enclosed_volume(there).value / enclosed_volume(rounded).value, 1, 1e-12);
    EXPECT_NEAR(surface_area(there).value / surface_area(rounded).value, 1, 1e-12);
    EXPECT_LT((volume_centroid(there) - far - volume_centroid(rounded)).norm(), 1e-8);
    EXPECT_LT((area_centroid(there) - far - area_centroid(rounded)).norm(), 1e-8);
  }
}

TEST(Centroids, OfAConeAndItsBase) {
  // A pyramid: centroid of the volume at a quarter of its height.
  MeasurableMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 2}};
  mesh.mesh.faces = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  EXPECT_LT((volume_centroid(mesh) - Eigen::Vector3d(0.5, 0.5, 0.5)).norm(), 1e-14);
  const double slope = std::sqrt(4.25) / 2;
  EXPECT_LT(
      (area_centroid(mesh) - Eigen::Vector3d(0.5, 0.5, 4 * slope * (2.0 / 3) / (1 + 4 * slope)))
          .norm(),
      1e-14);
}

TEST(SurfaceMeasures, PartsAddUpAndLabelsSplitASphere) {
  const auto half = test::with_labels(test::sphere_mesh(0.4), [](const Eigen::Vector3d& p) {
    return p.z() > 0 ? Provenance::Observed : Provenance::Inferred;
  });
  const MeasuredValue area = surface_area(half);
  EXPECT_NEAR(area.by_provenance[2] / area.value, 0.5, 1e-12);
  EXPECT_NEAR(area.by_provenance[0] + area.by_provenance[2], area.value, 1e-12);
  for (const MeasuredValue& v : {area, enclosed_volume(half)}) {
    EXPECT_TRUE(std::isnan(v.sigma));
    EXPECT_EQ(v.stated, 0);
  }
}

// The truth of a common error of all vertices: measure the solid made larger by it.
TEST(SurfaceMeasures, SigmaIsWhatALargerSolidShows) {
  const double sigma = 1e-4;
  const auto mesh = test::with_sigma(test::sphere_mesh(0.4), float(sigma));
  const auto larger = test::sphere_mesh(0.4 + sigma);
  const double area = surface_area(larger).value - surface_area(mesh).value;
  const double volume = enclosed_volume(larger).value - enclosed_volume(mesh).value;
  EXPECT_NEAR(surface_area(mesh).sigma / area, 1, 0.04);
  EXPECT_NEAR(enclosed_volume(mesh).sigma / volume, 1, 0.02);
  EXPECT_EQ(enclosed_volume(mesh).stated, 1);
}

// Vertices of flat surface that move along their normals leave its area as it is: what counts is
// how well its extent is known.
TEST(SurfaceMeasures, SigmaOfFlatAreaIsThatOfItsSides) {
  const double sigma = 1e-3;
  MeasurableMesh wall;
  wall.points = {{0, 0, 0}, {0.8, 0, 0}, {0.8, 0.6, 0}, {0, 0.6, 0}};
  for (const Eigen::Vector3d& p : wall.points) wall.mesh.vertices.push_back(p.cast<float>());
  wall.mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  wall = test::with_sigma(wall, float(sigma));
  const NearestSurface surface(wall);
  const MeasuredValue diagonal =
      straight_distance(wall, surface.nearest(wall.points[0]), surface.nearest(wall.points[2]));
  const MeasuredValue area = surface_area(wall);
  EXPECT_NEAR(area.sigma / area.value, 2 * diagonal.sigma / diagonal.value, 1e-6);
}

// Of plates apart, each is known by its own extent, however far from the other it lies.
TEST(SurfaceMeasures, SigmaOfPlatesApartIsThatOfEach) {
  const auto plates = [](double apart, uint32_t second) {
    MeasurableMesh out;
    out.points = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0}};
    out.mesh.faces = {{0, 1, 2}, {3, 4, 5}};  // by place they hang together
    for (uint32_t v = 0; v < second; ++v)
      out.points.push_back(out.points[v] + apart * Eigen::Vector3d::UnitX());
    if (second > 0) out.mesh.faces.push_back({6, 7, 8});
    if (second > 0) out.mesh.faces.push_back({9, 10, 11});
    return test::with_sigma(test::with_vertices(std::move(out)), 1e-3f);
  };
  const MeasuredValue one = surface_area(plates(0, 0));
  const MeasuredValue two = surface_area(plates(10, 6));
  EXPECT_NEAR(one.sigma / one.value, 2 * 0.65 * 1e-3 * std::sqrt(2) / std::hypot(0.1, 0.1), 1e-6);
  EXPECT_NEAR(two.value, 2 * one.value, 1e-12);
  EXPECT_NEAR(two.sigma / one.sigma, std::sqrt(2), 1e-9);
}

TEST(SurfaceMeasures, InventedSurfaceStatesNoSigma) {
  const MeasurableMesh sphere = test::with_sigma(test::sphere_mesh(0.4), 1e-4f);
  const double whole = enclosed_volume(sphere).sigma;
  for (const Provenance below : {Provenance::Inferred, Provenance::Estimated}) {
    const auto mesh = test::with_labels(
        sphere, [&](const Eigen::Vector3d& p) { return p.z() > 0 ? Provenance::Observed : below; });
    EXPECT_NEAR(enclosed_volume(mesh).stated, 0.5, 1e-12);
    EXPECT_NEAR(enclosed_volume(mesh).sigma / whole, 0.5, 0.02);
    EXPECT_NEAR(surface_area(mesh).stated, 0.5, 1e-12);
    EXPECT_NEAR(
        surface_area(mesh).by_provenance.at(size_t(below)) / surface_area(mesh).value, 0.5, 1e-12);
  }
}

TEST(StraightDistance, AddsTheVariancesOfItsEnds) {
  auto mesh = test::with_sigma(test::cube_mesh(0.5), 3e-3f);
  const NearestSurface surface(mesh);
  const auto a = surface.nearest({0.25, 0.25, -1});
  const auto b = surface.nearest({0.25, 0.25, 2});
  const MeasuredValue d = straight_distance(mesh, a, b);
  EXPECT_DOUBLE_EQ(d.value, 0.5);
  EXPECT_NEAR(d.sigma, 3e-3 * std::sqrt(2), 1e-9);
  // Along the surface a point is better known: both ends lie on faces that the line runs along.
  const auto c = surface.nearest({0.1, 0.25, -1});
  EXPECT_NEAR(straight_distance(mesh, a, c).sigma, 0.65 * 3e-3 * std::sqrt(2), 1e-9);
  mesh.mesh.sigma[0] = NAN;
  EXPECT_TRUE(std::isnan(straight_distance(mesh, surface.nearest({-1, -1, -1}), b).sigma));
}

TEST(OrientedBox, FindsATurnedBox) {
  MeasurableMesh mesh = test::with_sigma(test::cube_mesh(), 1e-3f);
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  for (Eigen::Vector3d& p : mesh.points) p = turn * p.cwiseProduct(Eigen::Vector3d(0.2, 0.9, 0.4));
  const OrientedBox box = oriented_box(mesh);
  EXPECT_NEAR(box.extents[0].value, 0.9, 1e-6);
  EXPECT_NEAR(box.extents[1].value, 0.4, 1e-6);
  EXPECT_NEAR(box.extents[2].value, 0.2, 1e-6);
  EXPECT_NEAR(box.axes.determinant(), 1, 1e-9);
  EXPECT_LT((box.center - turn * Eigen::Vector3d(0.1, 0.45, 0.2)).norm(), 1e-6);
  EXPECT_NEAR(box.extents[0].sigma, 1e-3 * std::sqrt(2), 1e-9);
}

// Surface that only virtual cameras saw has parts of its own, and is better than invented surface.
TEST(SurfaceMeasures, KnowVirtualSurface) {
  MeasurableMesh mesh = test::cube_mesh(0.5);
  mesh.mesh.provenance.assign(12, Provenance::Virtual);
  mesh.mesh.provenance[0] = Provenance::Inferred;
  mesh.mesh.provenance[1] = Provenance::Inferred;
  const auto part = [](const MeasuredValue& value, Provenance label) {
    return value.by_provenance.at(static_cast<size_t>(label));
  };
  EXPECT_DOUBLE_EQ(part(surface_area(mesh), Provenance::Virtual), 1.25);
  EXPECT_DOUBLE_EQ(part(oriented_box(mesh).extents[0], Provenance::Virtual), 0.5);
  const SurfacePoint below{0, {0, 0, 0}, {1, 0, 0}};
  const SurfacePoint above{2, {0, 0, 0.5}, {1, 0, 0}};
  EXPECT_DOUBLE_EQ(part(straight_distance(mesh, below, above), Provenance::Inferred), 0.5);
  EXPECT_DOUBLE_EQ(part(straight_distance(mesh, above, above), Provenance::Inferred), 0);
}

TEST(OrientedBox, OfFlatAndSinglePoints) {
  MeasurableMesh mesh;
  EXPECT_THROW(oriented_box(mesh), InvalidInput);
  mesh.points = {{0.25, 0.5, 1}};
  EXPECT_EQ(oriented_box(mesh).extents[0].value, 0);
  EXPECT_EQ(oriented_box(mesh).center, mesh.points[0]);
  mesh.points = {{0, 0, 0}, {0.5, 0, 0}, {0, 0.25, 0}};
  EXPECT_NEAR(oriented_box(mesh).extents[2].value, 0, 1e-15);
}

}  // namespace
}  // namespace cgs::surface_measures_test
