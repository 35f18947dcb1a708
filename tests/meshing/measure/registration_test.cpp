// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/registration.h"

#include <string>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"

namespace cgs::registration_test {
namespace {

// Waves that hold in every direction, a part of which may stand out.
MeasurableMesh relief(double bump = 0) {
  return test::grid_mesh(80, 80, [=](double s, double t) {
    double z = 0.05 * std::sin(9 * s) * std::cos(7 * t) + 0.1 * s * t;
    if (s > 0.7 && t > 0.7) z += bump;
    return Eigen::Vector3d(s, t, z);
  });
}

TEST(RegisterPoints, UndoesAMotion) {
  const auto mesh = relief();
  const NearestSurface surface(mesh);
  const Eigen::AngleAxisd turn(0.06, Eigen::Vector3d(1, -2, 1).normalized());
  const double grown = 1.03;
  for (const bool with_scale : {false, true}) {
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& p : points_by_area(mesh, 4000).places) {
      points.push_back((with_scale ? grown : 1.0) * (turn * p) +
                       Eigen::Vector3d(0.01, 0.02, -0.015));
    }
    const Registration r = register_points(points, mesh, surface, with_scale);
    EXPECT_LT((r.rotation * turn.toRotationMatrix() - Eigen::Matrix3d::Identity()).norm(), 1e-6);
    EXPECT_NEAR(r.scale, with_scale ? 1 / grown : 1, 1e-6);
    EXPECT_LT(r.rms_after, 1e-7);
    EXPECT_GT(r.rms_before, 1e-3);
  }
}

TEST(RegisterPoints, WhatChangedPullsLittle) {
  const auto before = relief();
  const auto after = relief(0.05);
  const Registration r =
      register_points(points_by_area(after, 8000).places, before, NearestSurface(before), false);
  for (const Eigen::Vector3d& p : before.points) EXPECT_LT((r.apply(p) - p).norm(), 1e-3);
}

// Most of the surface was invented, and badly.
TEST(RegisterPoints, WhatNobodySawPullsNothing) {
  const MeasurableMesh invented =
      test::with_labels(test::grid_mesh(80,
                                        80,
                                        [](double s, double t) {
                                          double z = 0.05 * std::sin(9 * s) * std::cos(7 * t);
                                          if (s > 0.45) z += 0.3 * (s - 0.45);
                                          return Eigen::Vector3d(s, t, z + 0.1 * s * t);
                                        }),
                        [](const Eigen::Vector3d& p) {
                          return p.x() > 0.45 ? Provenance::Inferred : Provenance::Observed;
                        });
  const MeasurableMesh truth = relief();
  const Registration r = register_points(truth.points, invented, NearestSurface(invented), false);
  EXPECT_TRUE(r.converged);
  EXPECT_LT(r.share, 0.5);
  for (const Eigen::Vector3d& p : truth.points) EXPECT_LT((r.apply(p) - p).norm(), 1e-3);
}

// A square of an endless relief, from column `first` of its grid on, 80 of which are one unit.
MeasurableMesh part_from(int first) {
  constexpr int kColumns = 80;
  return test::grid_mesh(kColumns, 40, [=](double s, double t) {
    const double x = (first + kColumns * s) / kColumns;
    return Eigen::Vector3d(x, t, 0.05 * std::sin(9 * x) * std::cos(7 * t) + 0.1 * x * t);
  });
}

TEST(RegisterPoints, WhatLiesBeyondTheRimPullsNothing) {
  const MeasurableMesh a = part_from(0);
  const MeasurableMesh b = part_from(48);  // 40 % of it is in A
  const NearestSurface surface(b);
  const std::vector<Eigen::Vector3d> places = points_by_area(a, 8000).places;
  const Registration in_place = register_points(places, b, surface, false);
  EXPECT_TRUE(in_place.converged);
  EXPECT_NEAR(in_place.share, 0.4, 0.05);
  const Eigen::AngleAxisd turn(0.01, Eigen::Vector3d(1, -2, 1).normalized());
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& p : places) {
    moved.emplace_back(turn * p + Eigen::Vector3d(0.002, 0.003, -0.002));
  }
  const Registration back = register_points(moved, b, surface, false);
  for (size_t i = 0; i < places.size(); ++i) {
    EXPECT_LT((in_place.apply(places[i]) - places[i]).norm(), 1e-6);
    EXPECT_LT((back.apply(moved[i]) - places[i]).norm(), 1e-5);
  }
}

TEST(RegisterPoints, RefusesSurfacesThatOverlapByFewPoints) {
  const MeasurableMesh b = part_from(79);
  try {
    register_points(points_by_area(part_from(0), 4000).places, b, NearestSurface(b), false);
    FAIL() << "50 of its points lie within the rim of the other";
  } catch (const NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("hardly meet where both were seen"), std::string::npos)
        << error.what();
  }
}

TEST(RegisterPoints, SaysWhatSlides) {
  const auto plane =
      test::grid_mesh(20, 20, [](double s, double t) { return Eigen::Vector3d(s, t, 0); });
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : points_by_area(plane, 1000).places) {
    points.emplace_back(0.5 * p.x() + 0.2, 0.5 * p.y() + 0.2, 0.01);
  }
  EXPECT_THROW(register_points(points, plane, NearestSurface(plane), false), NumericalError);
  points.resize(10);
  EXPECT_THROW(register_points(points, plane, NearestSurface(plane), false), InvalidInput);
}

}  // namespace
}  // namespace cgs::registration_test
