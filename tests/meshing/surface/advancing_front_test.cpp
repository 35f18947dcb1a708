// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/advancing_front.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/scene_files.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/sphere_cloud.h"

namespace cgs::advancing_front_test {
namespace {

constexpr double kPi = std::numbers::pi;

TriangleMesh half(int count) {
  const TriangleMesh ball = test::sphere_cloud(count);
  std::vector<uint8_t> keep;
  for (const auto& p : ball.vertices) keep.push_back(p.z() > 0 ? 1 : 0);
  return with_vertices(ball, keep);
}

float longest_edge(const TriangleMesh& mesh, const std::array<uint32_t, 3>& f) {
  const auto& p = mesh.vertices;
  return std::max(
      {(p[f[0]] - p[f[1]]).norm(), (p[f[1]] - p[f[2]]).norm(), (p[f[2]] - p[f[0]]).norm()});
}

// Whether all faces of a surface about the origin look away from it.
bool looks_out(const TriangleMesh& mesh) {
  return std::all_of(mesh.faces.begin(), mesh.faces.end(), [&](const auto& f) {
    const auto& [a, b, c] = f;
    return (mesh.vertices[b] - mesh.vertices[a])
               .cross(mesh.vertices[c] - mesh.vertices[a])
               .dot(mesh.vertices[a]) > 0;
  });
}

TEST(AdvancingFront, ClosesABallAndKeepsItsPoints) {
  TriangleMesh cloud = test::sphere_cloud(4000);
  for (size_t v = 0; v < cloud.sigma.size(); ++v) cloud.sigma[v] = 1e-3f * float(v + 1);
  const InterpolatedSurface out = advancing_front(cloud);
  const Certificate facts = certify(out.mesh);
  EXPECT_TRUE(facts.passed());
  EXPECT_NEAR(facts.area / (4 * kPi), 1, 0.003);
  EXPECT_NEAR(facts.observed_area, facts.area, 1e-9);
  EXPECT_EQ(out.unused, 0U);
  EXPECT_EQ(out.mesh.vertices, cloud.vertices);
  EXPECT_EQ(out.mesh.normals, cloud.normals);
  EXPECT_EQ(out.mesh.sigma, cloud.sigma);
  EXPECT_EQ(out.mesh.support, cloud.support);
}

TEST(AdvancingFront, LeavesHalfABallOpen) {
  TriangleMesh cloud = half(4000);
  for (const bool with_normals : {true, false}) {
    if (!with_normals) cloud.normals.clear();
    const InterpolatedSurface out = advancing_front(cloud);
    const Certificate facts = certify(out.mesh);
    EXPECT_FALSE(facts.closed);
    EXPECT_TRUE(facts.edge_manifold && facts.vertex_manifold);
    EXPECT_EQ(facts.euler_number, 1);  // a disc
    EXPECT_NEAR(facts.area / (2 * kPi), 1, 0.03);
    EXPECT_TRUE(looks_out(out.mesh));
  }
}

TEST(AdvancingFront, FacesLookAlongTheNormals) {
  TriangleMesh cloud = half(1000);
  for (auto& n : cloud.normals) n = -n;
  for (auto& f : cloud.faces) std::swap(f[0], f[1]);
  TriangleMesh turned = advancing_front(cloud).mesh;
  for (auto& f : turned.faces) std::swap(f[0], f[1]);
  EXPECT_TRUE(looks_out(turned));
  for (const Provenance label : turned.provenance) EXPECT_EQ(label, Provenance::Observed);
}

TEST(AdvancingFront, NormalsOfNoLengthAreNone) {
  TriangleMesh cloud = half(1000);
  for (auto& n : cloud.normals) n.setZero();
  EXPECT_TRUE(looks_out(advancing_front(cloud).mesh));
}

TEST(AdvancingFront, APlaneLooksToTheLargerSideOfItsAxis) {
  const TriangleMesh sheet =
      test::grid_mesh(20, 10, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f}) {
      TriangleMesh cloud;
      for (const auto& p : sheet.vertices) {
        Eigen::Vector3f turned;
        turned[(axis + 1) % 3] = side * p.x();
        turned[(axis + 2) % 3] = p.y();
        turned[axis] = 0.1f * p.y();
        cloud.vertices.push_back(turned);
      }
      const TriangleMesh out = advancing_front(cloud).mesh;
      for (const auto& [a, b, c] : out.faces) {
        const auto& p = out.vertices;
        EXPECT_GT((p[b] - p[a]).cross(p[c] - p[a])[axis], 0);
      }
    }
  }
}

TEST(AdvancingFront, NoEdgeIsLongerThanStated) {
  const TriangleMesh cloud = test::sphere_cloud(2000, 0.02);
  const InterpolatedSurface out = advancing_front(cloud, 0.12);
  size_t long_without = 0;
  for (const auto& f : out.mesh.faces) EXPECT_LE(longest_edge(out.mesh, f), 0.12f);
  const TriangleMesh free = advancing_front(cloud).mesh;
  for (const auto& f : free.faces) long_without += longest_edge(free, f) > 0.12f ? 1 : 0;
  EXPECT_GT(long_without, 0U);
  EXPECT_THROW(advancing_front(cloud, 1e-6), NumericalError);
}

TEST(AdvancingFront, AFaceIsAsWeakAsItsWeakestCorner) {
  TriangleMesh cloud = test::sphere_cloud(2000);
  std::mt19937 random(3);
  for (float& s : cloud.support) s = float(random() % 20 == 0 ? random() % 2 : 3);
  const TriangleMesh out = advancing_front(cloud).mesh;
  size_t weak = 0;
  for (size_t f = 0; f < out.faces.size(); ++f) {
    const auto& [a, b, c] = out.faces[f];
    const float least = std::min({out.support[a], out.support[b], out.support[c]});
    EXPECT_EQ(out.provenance[f],
              least >= 2   ? Provenance::Observed
              : least >= 1 ? Provenance::SingleView
                           : Provenance::Inferred);
    weak += least < 2 ? 1 : 0;
  }
  EXPECT_GT(weak, 100U);
}

// Triangles between the few points above span what was not measured.
TEST(AdvancingFront, WhatBridgesAGapIsInferredAndItsCornersStayAsTheyWere) {
  TriangleMesh ball = test::sphere_cloud(6000, 1e-5);
  std::vector<uint8_t> keep;
  for (size_t v = 0; v < ball.vertices.size(); ++v) {
    keep.push_back(ball.vertices[v].z() < 0.5f || v % 100 == 0 ? 1 : 0);
  }
  const TriangleMesh cloud = with_vertices(ball, keep);
  const InterpolatedSurface out = advancing_front(cloud);
  size_t bridges = 0;
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    float lowest = 1;
    for (const uint32_t v : out.mesh.faces[f]) lowest = std::min(lowest, out.mesh.vertices[v].z());
    if (lowest > 0.6f) {
      ++bridges;
      EXPECT_EQ(out.mesh.provenance[f], Provenance::Inferred);
    }
    if (lowest < 0.4f) EXPECT_EQ(out.mesh.provenance[f], Provenance::Observed);
  }
  EXPECT_GT(bridges, 5U);
  EXPECT_GT(out.evidence.bridged, 0.5 * 2 * kPi * 0.4);
  for (const float sigma : out.mesh.sigma) EXPECT_EQ(sigma, 1e-5f);
}

// Whatever lies in memory before: CGAL compares addresses.
TEST(AdvancingFront, IsAlwaysTheSame) {
  TriangleMesh grid = test::sphere_mesh(1, 40, 80).mesh;
  grid.faces.clear();
  for (const TriangleMesh& cloud : {grid, test::sphere_cloud(3000, 0.02)}) {
    const TriangleMesh first = advancing_front(cloud).mesh;
    std::vector<std::vector<char>> clutter;
    std::mt19937 random(5);
    for (int run = 0; run < 10; ++run) {
      for (int i = 0; i < 3000; ++i) clutter.emplace_back(1 + random() % 3000);
      for (size_t i = run; i < clutter.size(); i += 2) std::vector<char>().swap(clutter[i]);
      EXPECT_EQ(advancing_front(cloud).mesh.faces, first.faces) << run;
    }
  }
}

TEST(AdvancingFront, JoinsAPlane) {
  const TriangleMesh sheet =
      test::grid_mesh(20, 10, [](double s, double t) { return Eigen::Vector3d(2 * s, t, 0); }).mesh;
  TriangleMesh cloud;
  cloud.vertices = sheet.vertices;
  const InterpolatedSurface out = advancing_front(cloud);
  EXPECT_NEAR(certify(out.mesh).area, 2, 1e-5);
  EXPECT_TRUE(out.mesh.provenance.empty());
}

TEST(AdvancingFront, RefusesWhatItCannotUse) {
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  EXPECT_THROW(advancing_front(cube), InvalidInput);
  EXPECT_EQ(test::message_of([&] { advancing_front(cube); }),
            "joining points needs a point cloud: the number of faces must be 0, but is 12");
  EXPECT_THROW(advancing_front(test::sphere_cloud(2)), InvalidInput);
  EXPECT_THROW(advancing_front(test::sphere_cloud(50), 0), InvalidInput);
  TriangleMesh line;
  for (int i = 0; i < 9; ++i) line.vertices.emplace_back(float(i), 0.0f, 0.0f);
  EXPECT_THROW(advancing_front(line), NumericalError);
  line.vertices.assign(9, {1, 2, 3});
  EXPECT_THROW(advancing_front(line), NumericalError);
}

}  // namespace
}  // namespace cgs::advancing_front_test
