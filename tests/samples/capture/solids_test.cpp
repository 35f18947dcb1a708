// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/solids.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace cgs::solids_test {
namespace {

using std::numbers::pi;

double polygon_area(double radius, int sides) {
  return 0.5 * sides * radius * radius * std::sin(2 * pi / sides);
}

TEST(Box, IsClosedAndHasItsVolume) {
  const TriangleMesh mesh = box({-1, 2, 0.5}, {0, 4, 3.5});
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(enclosed_volume(mesh), 6, 1e-6);
}

TEST(Lathed, IsClosedAndHasTheVolumeOfItsFrustums) {
  const TriangleMesh mesh = lathed({.profile = {{1, 0}, {1, 2}, {0.5, 3}}, .sides = 48});
  EXPECT_TRUE(is_closed(mesh));
  const double cylinder = 2 * polygon_area(1, 48);
  const double frustum =
      (polygon_area(1, 48) + polygon_area(0.5, 48) + polygon_area(std::sqrt(0.5), 48)) / 3;
  EXPECT_NEAR(enclosed_volume(mesh), cylinder + frustum, 1e-5);
}

TEST(Lathed, CarvingScalesTheRadius) {
  const TriangleMesh mesh = lathed(
      {.profile = {{1, 0}, {1, 2}}, .sides = 48, .carving = [](double, double) { return 0.5; }});
  EXPECT_NEAR(enclosed_volume(mesh), 2 * polygon_area(0.5, 48), 1e-5);
}

TEST(Carved, AddsTheIntegralOfItsHeight) {
  const Relief relief{.width = 2,
                      .depth = 0.3,
                      .bottom = 1,
                      .top = 2,
                      .spacing = 0.1,
                      .height = [](double x, double) { return 0.1 + 0.05 * x; }};
  const TriangleMesh mesh = carved(relief);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(enclosed_volume(mesh), 2 * (0.3 + 0.1), 1e-5);
  EXPECT_NEAR(mesh.vertices.front().y(), -0.05F, 1e-6F);  // the front faces -y
}

TEST(Flange, IsClosedAndHasTheVolumeOfItsPolygons) {
  const Flange size{.rim_radius = 0.4,
                    .bore_radius = 0.15,
                    .hole_radius = 0.04,
                    .hole_circle = 0.28,
                    .thickness = 0.1,
                    .holes = 6,
                    .sides_per_hole = 10,
                    .radial_steps = 5};
  const TriangleMesh mesh = flange(size);
  EXPECT_TRUE(is_closed(mesh));
  const int hole_sides = 2 * size.sides_per_hole + 2 * size.radial_steps;
  const double area =
      polygon_area(0.4, 60) - polygon_area(0.15, 60) - 6 * polygon_area(0.04, hole_sides);
  EXPECT_NEAR(enclosed_volume(mesh), 0.1 * area, 1e-7);
}

TEST(BoredBlock, IsClosedAndHasItsVolume) {
  const BoredBlock size{};
  const TriangleMesh mesh = bored_block(size);
  EXPECT_TRUE(is_closed(mesh));
  const double wide = size.step_depth * polygon_area(size.wide_radius, size.sides);
  const double narrow =
      (size.size.z() - size.step_depth) * polygon_area(size.narrow_radius, size.sides);
  EXPECT_NEAR(enclosed_volume(mesh), size.size.prod() - wide - narrow, 1e-6);
}

TEST(Loft, JoinedMakesARing) {
  const auto square = [](double half, double z) {
    return Loop{{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
  };
  const TriangleMesh tube =
      loft({square(1, 0), square(1, 2), square(0.5, 2), square(0.5, 0)}, LoftEnds::Joined);
  EXPECT_TRUE(is_closed(tube));
  EXPECT_NEAR(enclosed_volume(tube), 2 * (4 - 1), 1e-6);
}

TEST(Refine, ShortensEveryEdgeAndKeepsTheSolid) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 0.3, 0.02});
  refine(mesh, 0.11);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(enclosed_volume(mesh), 0.006, 1e-7);
  for (const auto& f : mesh.faces) {
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_LE((mesh.vertices[f[i]] - mesh.vertices[f[(i + 1) % 3]]).norm(), 0.11F);
    }
  }
}

TEST(IsClosed, FindsAMissingAndATurnedFace) {
  TriangleMesh open = box({0, 0, 0}, {1, 1, 1});
  open.faces.pop_back();
  EXPECT_FALSE(is_closed(open));
  TriangleMesh turned = box({0, 0, 0}, {1, 1, 1});
  std::swap(turned.faces[3][0], turned.faces[3][1]);
  EXPECT_FALSE(is_closed(turned));
}

}  // namespace
}  // namespace cgs::solids_test
