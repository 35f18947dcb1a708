// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh_distance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::mesh_distance_test {
namespace {

// The square [0, side]^2 at height z.
TriangleMesh square(float side, float z) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, z}, {side, 0, z}, {side, side, z}, {0, side, z}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(SampleSurface, SpreadsPointsEvenly) {
  const auto points = sample_surface(square(2, 0), 4000);
  ASSERT_EQ(points.size(), 4000U);
  int count = 0;
  for (const auto& p : points) {
    ASSERT_EQ(p.z(), 0);
    count += p.x() < 1 && p.y() < 1;
  }
  EXPECT_NEAR(count, 1000, 30);
}

TEST(DistancesTo, AreThoseToTheNearestPoint) {
  const auto d = distances_to(square(1, 0), {{0.5f, 0.5f, 2}, {4, 5, 0}, {0.25f, 0.5f, 0}});
  EXPECT_FLOAT_EQ(d[0], 2);
  EXPECT_FLOAT_EQ(d[1], 5);
  EXPECT_FLOAT_EQ(d[2], 0);
}

TEST(MeshDistance, TellsAccuracyFromCompleteness) {
  const MeshDistance d = mesh_distance(square(1, 0.25f), square(2, 0), 10000);
  EXPECT_NEAR(d.accuracy.mean, 0.25, 1e-6);
  EXPECT_NEAR(d.accuracy.max, 0.25, 1e-6);
  EXPECT_NEAR(d.completeness.max, std::sqrt(2 + 0.0625), 0.06);
  EXPECT_GT(d.completeness.mean, 0.25);
  EXPECT_DOUBLE_EQ(d.hausdorff(), d.completeness.max);
}

TEST(MeshDistance, RefusesAMeshWithoutArea) {
  EXPECT_THROW(mesh_distance({}, square(1, 0), 10), InvalidInput);
  EXPECT_THROW(mesh_distance(square(1, 0), {}, 10), InvalidInput);
}

TEST(Statistics, SummariseKnownNumbers) {
  const DistanceStatistics s = statistics({3, 1, 2, 4, 0});
  EXPECT_DOUBLE_EQ(s.mean, 2);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(6.0));
  EXPECT_DOUBLE_EQ(s.median, 2);
  EXPECT_DOUBLE_EQ(s.max, 4);
}

TEST(Cast, FindsTheFirstHitInLengthsOfTheDirection) {
  TriangleMesh mesh = square(1, 1);
  const TriangleMesh behind = square(1, 3);
  for (const auto& v : behind.vertices) mesh.vertices.push_back(v);
  mesh.faces.push_back({4, 5, 6});
  mesh.faces.push_back({4, 6, 7});
  const auto t = cast(mesh,
                      {{0.5f, 0.25f, 0}, {0.5f, 0.25f, 0}, {0.5f, 0.25f, 2}},
                      {{0, 0, 0.5f}, {0, 0, -1}, {0, 0, 1}});
  EXPECT_FLOAT_EQ(t[0], 2);
  EXPECT_TRUE(std::isnan(t[1]));
  EXPECT_FLOAT_EQ(t[2], 1);
}

TEST(Cast, RefusesArraysOfDifferentLength) {
  EXPECT_THROW(cast(square(1, 0), {{0, 0, 0}}, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::mesh_distance_test
