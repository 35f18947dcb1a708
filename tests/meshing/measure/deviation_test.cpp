// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/deviation.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/solid_meshes.h"

namespace cgs::deviation_test {
namespace {

MeasurableMesh half_invented(const MeasurableMesh& mesh) {
  return test::with_labels(mesh, [](const Eigen::Vector3d& p) {
    return p.z() > 0 ? Provenance::Observed : Provenance::Inferred;
  });
}

TEST(Deviations, OfConcentricSpheres) {
  const auto inner = test::sphere_mesh(0.3, 100, 200);
  const auto outer = test::sphere_mesh(0.32, 100, 200);
  const DeviationSummary out =
      summarize(deviations(points_by_area(outer, 20000), inner, NearestSurface(inner)));
  EXPECT_NEAR(out.mean, 0.02, 1e-4);
  EXPECT_NEAR(out.rms, 0.02, 1e-4);
  EXPECT_LT(out.standard_deviation, 1e-4);
  EXPECT_EQ(out.count, 20000U);
  const DeviationSummary in =
      summarize(deviations(points_by_area(inner, 20000), outer, NearestSurface(outer)));
  EXPECT_NEAR(in.mean, -0.02, 1e-4);
  EXPECT_NEAR(in.p95_absolute, 0.02, 2e-4);
}

TEST(Deviations, SummaryAgreesWithASlowOne) {
  std::vector<Deviation> all;
  for (int i = 0; i < 1001; ++i) all.push_back({(i - 300) * 0.001, 0, Change::None});
  const DeviationSummary s = summarize(all);
  EXPECT_NEAR(s.mean, 0.2, 1e-12);
  EXPECT_NEAR(s.median, 0.2, 1e-12);
  EXPECT_NEAR(s.p05, -0.25, 1e-12);
  EXPECT_NEAR(s.p95, 0.65, 1e-12);
  EXPECT_NEAR(s.max_absolute, 0.7, 1e-12);
  EXPECT_NEAR(s.rms * s.rms, s.mean * s.mean + s.standard_deviation * s.standard_deviation, 1e-12);
  const auto counts = histogram(all, -0.3, 0.7, 10);
  for (size_t i = 0; i + 1 < counts.size(); ++i) EXPECT_NEAR(double(counts[i]), 100, 1);
  EXPECT_EQ(summarize({}).count, 0U);
}

TEST(Deviations, OnlyWhatBothSawCanChange) {
  const float sigma = 0.005f;
  const auto before = test::with_sigma(test::sphere_mesh(0.3), sigma);
  // Beyond 2 sqrt(2) * 0.005 = 0.0141; and within.
  for (const double by : {0.02, 0.01}) {
    const auto after = half_invented(test::with_sigma(test::sphere_mesh(0.3 + by), sigma));
    const auto found = deviations(points_by_area(after, 5000), before, NearestSurface(before));
    const auto points = points_by_area(after, 5000);
    size_t unknown = 0;
    for (size_t i = 0; i < found.size(); ++i) {
      unknown += found[i].change == Change::Unknown;
      if (points.places[i].z() < -0.03) {
        EXPECT_EQ(found[i].change, Change::Unknown);
      }
      if (points.places[i].z() > 0.03) {
        EXPECT_EQ(found[i].change, by > 0.0141 ? Change::Farther : Change::None);
      }
    }
    EXPECT_NEAR(double(unknown), 2500, 50);
  }
  const auto smaller = test::with_sigma(test::sphere_mesh(0.28), sigma);
  for (const Deviation& d : deviations(points_by_vertex(smaller), before, NearestSurface(before))) {
    EXPECT_EQ(d.change, Change::Nearer);
  }
  const auto silent = test::sphere_mesh(0.28);
  for (const Deviation& d : deviations(points_by_vertex(silent), before, NearestSurface(before))) {
    EXPECT_EQ(d.change, Change::Unknown);
  }
}

// A square [0, 1]^2 at z = 0, and places above, below and beside it.
TEST(Deviations, NothingIsKnownBeyondTheRim) {
  const auto square = test::with_sigma(
      test::grid_mesh(8, 8, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }), 1e-3f);
  const auto at = [&](const Eigen::Vector3d& place) {
    ComparedPoints points;
    points.places = {place};
    points.sigma = {1e-3};
    points.observed = {1};
    return deviations(points, square, NearestSurface(square)).at(0);
  };
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(1.3, 0.5, 0),
                                       Eigen::Vector3d(1.3, 0.5, 0.1),
                                       Eigen::Vector3d(1.0001, 0.55, -0.1),
                                       Eigen::Vector3d(-0.2, -0.2, 0.1),
                                       Eigen::Vector3d(-0.2, 1.2, 0)}) {
    const Deviation beyond = at(place);
    EXPECT_EQ(beyond.change, Change::Unknown) << place.transpose();
    EXPECT_TRUE(beyond.is_beyond_rim) << place.transpose();
  }
  EXPECT_NEAR(at({1.3, 0.5, 0}).distance, 0.3, 1e-12);
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(0.55, 0.5, 0.1),
                                       Eigen::Vector3d(1, 0.5, 0.1),
                                       Eigen::Vector3d(1, 1, 0.1),
                                       Eigen::Vector3d(1 + 1e-8, 0.55, 0.1)}) {
    const Deviation above = at(place);
    EXPECT_EQ(above.change, Change::Farther) << place.transpose();
    EXPECT_FALSE(above.is_beyond_rim) << place.transpose();
  }
  EXPECT_EQ(at({1, 0.55, -0.1}).change, Change::Nearer);
  EXPECT_EQ(at({1, 0.55, 0}).change, Change::None);
}

TEST(Deviations, AnErrorOfTheScaleIsNoChange) {
  const auto before = test::with_sigma(test::sphere_mesh(0.3), 1e-3f);
  const auto after = test::with_sigma(test::sphere_mesh(0.306), 1e-3f);
  const NearestSurface surface(before);
  ComparedPoints points = points_by_area(after, 2000);
  for (const Deviation& d : deviations(points, before, surface)) {
    EXPECT_EQ(d.change, Change::Farther);
  }
  add_scale_sigma(points, 0.02, {0, 0, 0});
  for (const Deviation& d : deviations(points, before, surface)) {
    EXPECT_EQ(d.change, Change::None);
    EXPECT_NEAR(d.sigma, std::hypot(1e-3, 1e-3, 0.02 * 0.306), 3e-5);
  }
}

TEST(PointsByArea, TakesAllPointsOfACloud) {
  MeasurableMesh cloud;
  cloud.points = {{0, 0, 0.5}, {0, 0, -0.5}};
  const auto mesh = test::cube_mesh();
  const auto found = deviations(points_by_area(cloud, 10), mesh, NearestSurface(mesh));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0].distance, 0, 1e-15);
  EXPECT_NEAR(found[1].distance, 0.5, 1e-15);
}

}  // namespace
}  // namespace cgs::deviation_test
