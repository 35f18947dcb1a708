// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/thickness.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/triangle_tree.h"
#include "tests/support/solid_meshes.h"

namespace cgs::thickness_test {
namespace {

using Eigen::Vector3d;

// A box [0, x] x [0, y] x [0, z] as 12 faces.
MeasurableMesh box_mesh(double x, double y, double z) {
  MeasurableMesh out = test::cube_mesh();
  for (Vector3d& p : out.points) p = p.cwiseProduct(Vector3d(x, y, z));
  return test::with_vertices(std::move(out));
}

// A closed cone with its tip at (0, 0, 0) and its base at z = height; rings as far apart as wide.
MeasurableMesh cone_mesh(double half_angle, double height, int around = 360) {
  MeasurableMesh out;
  out.points = {{0, 0, 0}, {0, 0, height}};
  constexpr int kRings = 40;
  for (int r = 1; r <= kRings; ++r) {
    for (int i = 0; i < around; ++i) {
      const double a = 2 * std::numbers::pi * i / around;
      const double z = height * r / kRings;
      const double radius = z * std::tan(half_angle);
      out.points.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
    }
  }
  const auto at = [&](int r, int i) {
    return static_cast<uint32_t>(2 + (r - 1) * around + i % around);
  };
  for (int i = 0; i < around; ++i) {
    out.mesh.faces.push_back({0, at(1, i + 1), at(1, i)});
    for (int r = 1; r < kRings; ++r) {
      out.mesh.faces.push_back({at(r, i), at(r, i + 1), at(r + 1, i + 1)});
      out.mesh.faces.push_back({at(r, i), at(r + 1, i + 1), at(r + 1, i)});
    }
    out.mesh.faces.push_back({1, at(kRings, i), at(kRings, i + 1)});
  }
  return test::with_vertices(std::move(out));
}

Thickness thickness_near(const MeasurableMesh& mesh, const Vector3d& point) {
  const NearestSurface surface(mesh);
  return ThicknessGauge(mesh, surface).at(surface.nearest(point));
}

// A box [0, 10]^3 whose edge along y at the largest x and z is a fillet of radius 2, three planes
// that touch it: four bends of 22.5 degrees.
MeasurableMesh filleted_box() {
  constexpr double kSide = 10;
  constexpr double kRadius = 2;
  constexpr double kStep = std::numbers::pi / 8;
  std::vector<Eigen::Vector2d> rim = {{0, 0}, {kSide, 0}};  // x and z, counter-clockwise
  for (int k = 0; k < 4; ++k) {
    const double angle = (k + 0.5) * kStep;
    const double out = kRadius / std::cos(0.5 * kStep);
    rim.emplace_back(kSide - kRadius + out * std::cos(angle),
                     kSide - kRadius + out * std::sin(angle));
  }
  rim.emplace_back(0, kSide);
  const auto n = static_cast<uint32_t>(rim.size());
  MeasurableMesh out;
  for (const double y : {0.0, kSide}) {
    for (const Eigen::Vector2d& p : rim) out.points.emplace_back(p.x(), y, p.y());
  }
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t next = (i + 1) % n;
    out.mesh.faces.push_back({i, i + n, next + n});
    out.mesh.faces.push_back({i, next + n, next});
    if (i == 0 || next == 0) continue;
    out.mesh.faces.push_back({0, i, next});
    out.mesh.faces.push_back({n, next + n, i + n});
  }
  return test::with_vertices(std::move(out));
}

// Vertices of a fillet have the normals of the large faces beside it, which lean 22.5 degrees from
// its own: the ball must not shrink to nothing for that.
TEST(Thickness, OfACoarseFilletIsNotNothing) {
  const MeasurableMesh box = filleted_box();
  const NearestSurface surface(box);
  const ThicknessGauge gauge(box, surface);
  constexpr int kParts = 12;
  int measured = 0;
  for (uint32_t f = 0; f < box.mesh.faces.size(); ++f) {
    const auto& [a, b, c] = box.mesh.faces[f];
    const Vector3d across = (box.points[b] - box.points[a]).cross(box.points[c] - box.points[a]);
    if (across.x() < 1 || across.z() < 1) continue;  // not the fillet
    for (int i = 1; i < kParts; ++i) {
      for (int j = 1; j < kParts - i; ++j) {
        const Vector3d w = Vector3d(i, j, kParts - i - j) / kParts;
        const Vector3d p = w[0] * box.points[a] + w[1] * box.points[b] + w[2] * box.points[c];
        if (p.y() < 2.5 || p.y() > 7.5) continue;  // the ball would touch the ends
        const double found = gauge.at({f, p, w}).value.value;
        EXPECT_GT(found, 2) << f << ": " << w.transpose();
        EXPECT_LT(found, 4.5) << f << ": " << w.transpose();
        ++measured;
      }
    }
  }
  EXPECT_GT(measured, 100);
}

TEST(Thickness, OfAPlateIsItsOwnFromEitherSide) {
  const MeasurableMesh plate = box_mesh(1, 0.8, 0.02);
  for (const double z : {0.0, 0.02}) {
    const Thickness t = thickness_near(plate, {0.43, 0.31, z});
    EXPECT_NEAR(t.value.value, 0.02, 1e-12);
    EXPECT_NEAR((t.far_side.position - Vector3d(0.43, 0.31, 0.02 - z)).norm(), 0, 1e-9);
  }
  // Nearer to the rim than half of it, the ball touches the rim.
  EXPECT_NEAR(thickness_near(plate, {0.004, 0.31, 0.02}).value.value, 0.008, 1e-9);
}

TEST(Thickness, OfABallIsItsDiameterAndItsFacetsDoNotMatter) {
  const MeasurableMesh ball = test::sphere_mesh(0.3, 64, 128);
  const NearestSurface surface(ball);
  const ThicknessSummary all = summarize_thickness(ball, surface, 1000);
  const double sagitta = 0.3 * (1 - std::cos(std::numbers::pi / 64));
  EXPECT_EQ(all.samples, 1000U);
  EXPECT_EQ(all.without_far_side, 0);
  EXPECT_EQ(all.seen.share, 1);
  EXPECT_LE(all.seen.max, 0.6 * 1.002);  // what may reach in
  EXPECT_GT(all.seen.min, 0.6 * 0.99);   // facets at the poles are long
  EXPECT_NEAR(all.seen.median, 0.6, 2 * sagitta);
}

TEST(Thickness, OfAConeGrowsFromItsTip) {
  const double half_angle = 0.2;
  const MeasurableMesh cone = cone_mesh(half_angle, 1);
  for (const double slant : {0.2, 0.4, 0.6}) {
    const Vector3d at(slant * std::sin(half_angle), 0, slant * std::cos(half_angle));
    const double expected = 2 * slant * std::tan(half_angle);
    EXPECT_NEAR(thickness_near(cone, at).value.value / expected, 1, 2e-3) << slant;
  }
}

TEST(Thickness, OfATorusIsThatOfItsTube) {
  const MeasurableMesh torus = test::torus_mesh(0.6, 0.2, 128, 64);
  const NearestSurface surface(torus);
  const ThicknessSummary all = summarize_thickness(torus, surface, 3000);
  EXPECT_NEAR(all.seen.p05, 0.4, 0.4 * 0.005);
  EXPECT_NEAR(all.seen.p95, 0.4, 0.4 * 0.005);
}

// A box whose upper side slopes.
MeasurableMesh wedge_mesh(double slope) {
  MeasurableMesh mesh = box_mesh(1, 0.8, 0.2);
  for (Vector3d& p : mesh.points) p.z() += p.z() > 0 ? slope * p.x() : 0;
  return test::with_vertices(std::move(mesh));
}

double slow_distance(const MeasurableMesh& mesh, const Vector3d& point) {
  double least = 1e300;
  for (const auto& f : mesh.mesh.faces) {
    const Vector3d& a = mesh.points[f[0]];
    const Vector3d& b = mesh.points[f[1]];
    const Vector3d& c = mesh.points[f[2]];
    const Vector3d w = nearest_weights(a, b, c, point);
    least = std::min(least, (w[0] * a + w[1] * b + w[2] * c - point).norm());
  }
  return least;
}

// The largest radius whose ball is empty, by halving: balls that touch at one point are nested.
double slow_thickness(const MeasurableMesh& mesh, const Vector3d& at, const Vector3d& normal) {
  double inside = 0;
  double outside = 2;
  for (int i = 0; i < 60; ++i) {
    const double r = 0.5 * (inside + outside);
    (slow_distance(mesh, at - r * normal) >= r * (1 - 1e-12) ? inside : outside) = r;
  }
  return 2 * inside;
}

TEST(Thickness, IsThatOfASlowSearchForTheLargestEmptyBall) {
  const MeasurableMesh wedge = wedge_mesh(0.3);
  const NearestSurface surface(wedge);
  const ThicknessGauge gauge(wedge, surface);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int i = 0; i < 200; ++i) {
    const Vector3d near(unit(random), 0.8 * unit(random), i % 2 == 0 ? -1 : 1);
    const SurfacePoint at = surface.nearest(near);
    const Vector3d normal = evidence_at(wedge, at).normal;
    EXPECT_NEAR(gauge.at(at).value.value, slow_thickness(wedge, at.position, normal), 1e-7) << i;
  }
}

TEST(Thickness, SigmaIsWhatMovedEndsDoToIt) {
  // Both sides of a plate move on their own; and a wedge, where they are not parallel.
  const double step = 1e-6;
  const Vector3d at(0.5, 0.4, 0);
  for (const double slope : {0.0, 0.1}) {
    const auto wedge = [&](double bottom, double top) {
      MeasurableMesh mesh = box_mesh(1, 0.8, 0.02);
      for (Vector3d& p : mesh.points) {
        if (p.z() > 0) {
          p.z() += slope * p.x() + top * std::hypot(1, slope);
        } else {
          p.z() -= bottom;
        }
      }
      return thickness_near(test::with_sigma(test::with_vertices(mesh), 0.003f),
                            at - Vector3d(0, 0, bottom));
    };
    const Thickness t = wedge(0, 0);
    const double by_bottom = (wedge(step, 0).value.value - t.value.value) / step;
    const double by_top = (wedge(0, step).value.value - t.value.value) / step;
    EXPECT_NEAR(t.value.sigma, 0.003 * std::hypot(by_bottom, by_top), 1e-6) << slope;
    EXPECT_EQ(t.value.stated, 1);
  }
}

TEST(Thickness, BelongsToTheWeakerOfItsEnds) {
  const MeasurableMesh plate =
      test::with_labels(test::with_sigma(box_mesh(1, 1, 0.02), 0.001f), [](const Vector3d& p) {
        return p.z() > 0.015 ? Provenance::Observed : Provenance::Inferred;
      });
  const Thickness t = thickness_near(plate, {0.4, 0.3, 0.02});
  EXPECT_NEAR(t.value.by_provenance.at(size_t(Provenance::Inferred)), 0.02, 1e-12);
  EXPECT_EQ(t.value.by_provenance.at(size_t(Provenance::Observed)), 0);
  EXPECT_TRUE(std::isnan(t.value.sigma));  // nothing is known of the far side
  EXPECT_EQ(t.value.stated, 0.5);
  const NearestSurface surface(plate);
  const ThicknessSummary all = summarize_thickness(plate, surface, 2000);
  EXPECT_EQ(all.seen.share, 0);  // every ball touches the lower side or the rim
  EXPECT_NEAR(all.unseen.median, 0.02, 1e-9);
  EXPECT_NEAR(all.seen.share + all.unseen.share, 1, 1e-12);
}

TEST(Thickness, IsSeenOnlyWhereAPhotographVouchesForBothEnds) {
  for (const auto& [label, is_seen] : {std::pair(Provenance::Observed, true),
                                       std::pair(Provenance::SingleView, true),
                                       std::pair(Provenance::Interpolated, false),
                                       std::pair(Provenance::Virtual, false),
                                       std::pair(Provenance::Inferred, false)}) {
    const MeasurableMesh plate =
        test::with_labels(box_mesh(1, 1, 0.02), [&, below = label](const Vector3d& p) {
          return p.z() > 0.015 ? Provenance::Observed : below;
        });
    const NearestSurface surface(plate);
    const ThicknessSummary all = summarize_thickness(plate, surface, 2000);
    EXPECT_EQ(all.seen.share, is_seen ? 1 : 0) << int(label);
    EXPECT_EQ(all.unseen.share, is_seen ? 0 : 1) << int(label);
    for (const uint8_t unseen : thickness_of_vertices(plate, surface).is_unseen) {
      EXPECT_EQ(unseen, is_seen ? 0 : 1) << int(label);
    }
  }
}

TEST(Thickness, IsNoneWhereNothingLiesBehind) {
  const MeasurableMesh sheet =
      test::grid_mesh(10, 10, [](double s, double t) { return Vector3d(s, t, 0.3); });
  EXPECT_FALSE(thickness_near(sheet, {0.52, 0.41, 0.3}).has_far_side());
  const NearestSurface surface(sheet);
  EXPECT_EQ(summarize_thickness(sheet, surface, 100).without_far_side, 1);
  const VertexThickness vertices = thickness_of_vertices(sheet, surface);
  EXPECT_TRUE(std::isnan(vertices.value[12]));
  EXPECT_EQ(vertices.is_unseen[12], 0);  // nobody invented a far side: there is none
}

TEST(Thickness, OfVerticesIsThatOfTheirFaces) {
  const MeasurableMesh ball = test::sphere_mesh(0.3, 16, 32);
  for (const float t : thickness_of_vertices(ball, NearestSurface(ball)).value) {
    EXPECT_NEAR(t, 0.6f, 0.02f);
  }
  for (const bool is_seen_below : {false, true}) {
    const MeasurableMesh plate = test::with_labels(box_mesh(1, 1, 0.02), [&](const Vector3d& p) {
      return p.z() > 0.015 || is_seen_below ? Provenance::Observed : Provenance::Inferred;
    });
    const VertexThickness found = thickness_of_vertices(plate, NearestSurface(plate));
    for (const uint8_t unseen : found.is_unseen) EXPECT_EQ(unseen, is_seen_below ? 0 : 1);
  }
}

}  // namespace
}  // namespace cgs::thickness_test
