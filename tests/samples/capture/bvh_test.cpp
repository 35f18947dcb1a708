// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/bvh.h"

#include <random>

#include <gtest/gtest.h>

#include "samples/capture/solids.h"

namespace cgs::bvh_test {
namespace {

using Eigen::Vector3d;

// Small, large, thin and overlapping triangles.
TriangleMesh triangle_soup(int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1, 1);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const float size = i % 20 == 0 ? 1.0F : 0.05F;
    const Eigen::Vector3f centre(place(random), place(random), place(random));
    const auto v = static_cast<uint32_t>(mesh.vertices.size());
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.emplace_back(
          centre + size * Eigen::Vector3f(place(random), place(random), place(random)));
    }
    mesh.faces.push_back({v, v + 1, v + 2});
  }
  return mesh;
}

// The obvious way: every triangle.
std::optional<RayHit> slow_first_hit(const TriangleMesh& mesh, Ray ray) {
  std::optional<RayHit> nearest;
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    const auto hit = hit_triangle({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], f}, ray);
    if (!hit) continue;
    nearest = hit;
    ray.t_max = hit->t;
  }
  return nearest;
}

TEST(HitTriangle, FindsPlaceAndBarycentricWeights) {
  const Bvh::Triangle triangle{{0, 0, 2}, {4, 0, 2}, {0, 4, 2}, 17};
  const auto hit = hit_triangle(triangle, {.origin = {1, 2, 0}, .direction = {0, 0, 0.5}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->face, 17U);
  EXPECT_DOUBLE_EQ(hit->t, 4);
  EXPECT_DOUBLE_EQ(hit->b1, 0.25);
  EXPECT_DOUBLE_EQ(hit->b2, 0.5);
}

TEST(HitTriangle, RespectsTheRangeOfTheRay) {
  const Bvh::Triangle triangle{{0, 0, 2}, {4, 0, 2}, {0, 4, 2}, 0};
  const Ray ray{.origin = {1, 1, 0}, .direction = Vector3d::UnitZ()};
  EXPECT_TRUE(hit_triangle(triangle, ray));
  EXPECT_FALSE(hit_triangle(triangle, {ray.origin, ray.direction, 2.0, 9.0}));
  EXPECT_FALSE(hit_triangle(triangle, {ray.origin, ray.direction, 0.0, 2.0}));
  EXPECT_FALSE(hit_triangle(triangle, {ray.origin, -ray.direction}));
  EXPECT_FALSE(hit_triangle(triangle, {Vector3d(3, 3, 0), ray.direction}));
}

TEST(FirstHit, EqualsTestingEveryTriangle) {
  const TriangleMesh mesh = triangle_soup(2000);
  const Bvh bvh = build_bvh(mesh);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-2, 2);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    Ray ray{.origin = {place(random), place(random), place(random)},
            .direction = {place(random), place(random), place(random)}};
    if (i % 3 == 0) ray.direction[i % 9 / 3] = 0;  // along the sides of boxes
    if (i % 5 == 0) ray.t_max = 0.3;
    const auto slow = slow_first_hit(mesh, ray);
    const auto fast = first_hit(bvh, ray);
    ASSERT_EQ(slow.has_value(), fast.has_value()) << i;
    EXPECT_EQ(any_hit(bvh, ray), slow.has_value()) << i;
    if (!slow) continue;
    ++hits;
    EXPECT_EQ(slow->t, fast->t);
    EXPECT_EQ(slow->face, fast->face);
  }
  EXPECT_GT(hits, 300);
}

TEST(FirstHit, LetsNoRaySlipThroughEdgesAndCorners) {
  TriangleMesh sheet = box({-1, -1, 0}, {1, 1, 1});
  refine(sheet, 0.2);
  const Bvh bvh = build_bvh(sheet);
  for (const auto& v : sheet.vertices) {
    if (v.head<2>().cwiseAbs().maxCoeff() > 0.999F) continue;  // the rim of the box
    for (const double slant : {0.0, 0.1, 1.0 / 3}) {
      const Vector3d direction(slant, -slant, 1);
      const Vector3d target(v.cast<double>().x(), v.cast<double>().y(), 0);
      EXPECT_TRUE(any_hit(bvh, {.origin = target - 5 * direction, .direction = direction}));
    }
  }
}

TEST(FirstHit, FindsNothingInAnEmptyMesh) {
  const Bvh bvh = build_bvh({});
  EXPECT_FALSE(first_hit(bvh, {}));
  EXPECT_FALSE(any_hit(bvh, {}));
}

TEST(BuildBvh, HoldsManyTrianglesInOnePlace) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  mesh.faces.assign(500, {0, 1, 2});
  EXPECT_TRUE(any_hit(build_bvh(mesh), {.origin = {0.2, 0.2, 0}}));
}

TEST(FaceNormal, PointsToTheCounterClockwiseSide) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 5}, {3, 0, 5}, {0, 7, 5}};
  mesh.faces = {{0, 1, 2}};
  EXPECT_EQ(face_normal(mesh, 0), Vector3d::UnitZ());
}

}  // namespace
}  // namespace cgs::bvh_test
