// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <random>

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

// A sheet over [0, 1]^2 whose corners are at random heights.
TriangleMesh rough_sheet(uint32_t n, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> height(-0.02f, 0.02f);
  TriangleMesh mesh;
  for (uint32_t j = 0; j <= n; ++j) {
    for (uint32_t i = 0; i <= n; ++i) {
      mesh.vertices.emplace_back(float(i) / float(n), float(j) / float(n), height(random));
    }
  }
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t v = j * (n + 1) + i;
      mesh.faces.push_back({v, v + 1, v + n + 2});
      mesh.faces.push_back({v, v + n + 2, v + n + 1});
    }
  }
  return mesh;
}

TEST(DistanceToMeshOfEdges, IsThatOfPlacesCloseTogetherOnThem) {
  const TriangleMesh mesh = rough_sheet(7, 1);
  const TriangleMesh reference = rough_sheet(11, 2);
  constexpr double kAccuracy = 1e-5;
  const DistanceToMesh distance(reference);
  const std::vector<float> found =
      distance.of_edges(mesh, std::vector<float>(mesh.faces.size(), 0), kAccuracy);
  constexpr int kSteps = 2000;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    std::vector<Eigen::Vector3f> places;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f a = mesh.vertices[mesh.faces[f].at(k)];
      const Eigen::Vector3f b = mesh.vertices[mesh.faces[f].at((k + 1) % 3)];
      for (int i = 0; i <= kSteps; ++i) places.emplace_back(a + float(i) / kSteps * (b - a));
    }
    const std::vector<float> close = distance.of(places);
    const double farthest = double(*std::max_element(close.begin(), close.end()));
    ASSERT_GE(double(found[f]), farthest - 1e-8) << f;
    ASSERT_LE(double(found[f]), farthest + kAccuracy + 0.5 * std::sqrt(2) / 7 / kSteps) << f;
  }
}

TEST(DistanceToMeshOfEdges, SeesTheTwoDiagonalsOfABentSquareApart) {
  TriangleMesh mesh = square(1, 0);
  mesh.vertices[0].z() = mesh.vertices[2].z() = 0.1f;
  TriangleMesh other = mesh;
  other.faces = {{0, 1, 3}, {1, 2, 3}};
  const std::vector<float> found = DistanceToMesh(other).of_edges(mesh, {0.01f, 0}, 1e-6);
  // From (0.5, 0.5, 0.1) to the line from (1, 0, 0) to (0, 1, 0), or to the faces beside it.
  const double nearest = 0.1 * std::cos(std::atan(0.1 * std::sqrt(2.0)));
  EXPECT_NEAR(double(found[0]), nearest, 2e-6);
  EXPECT_NEAR(double(found[1]), nearest, 2e-6);
  const std::vector<float> none = DistanceToMesh(other).of_edges(mesh, {1, 1}, 1e-6);
  EXPECT_EQ(none, std::vector<float>(2, 0)) << "not beyond what is enough";
  const DistanceToMesh nowhere{TriangleMesh()};
  EXPECT_TRUE(std::isinf(nowhere.of({{0, 0, 0}})[0]));
  EXPECT_TRUE(std::isinf(nowhere.of_edges(mesh, {1, 1}, 1e-6)[0]));
  EXPECT_THROW(DistanceToMesh(other).of_edges(mesh, {1}, 1e-6), InvalidInput);
  EXPECT_THROW(DistanceToMesh(other).of_edges(mesh, {1, 1}, 0), InvalidInput);
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
