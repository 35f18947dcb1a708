// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/repair.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "meshing/mesh/certificate.h"
#include "meshing/mesh/self_intersections.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::repair_test {
namespace {

// Every face with corners of its own, as in an STL.
TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh out;
  out.provenance = mesh.provenance;
  for (const auto& face : mesh.faces) {
    const auto first = static_cast<uint32_t>(out.vertices.size());
    for (const uint32_t v : face) {
      out.vertices.push_back(mesh.vertices[v]);
      if (!mesh.sigma.empty()) out.sigma.push_back(mesh.sigma[v]);
      if (!mesh.support.empty()) out.support.push_back(mesh.support[v]);
    }
    out.faces.push_back({first, first + 1, first + 2});
  }
  return out;
}

TEST(Repaired, MakesTheBallOfItsTurnedSoupAgain) {
  const TriangleMesh ball = test::labelled_sphere();
  TriangleMesh soup = soup_of(ball);
  std::mt19937 random(2);
  size_t turned = 0;
  for (auto& face : soup.faces) {
    if (random() % 3 != 0) continue;
    std::swap(face[0], face[2]);
    ++turned;
  }
  soup.faces.push_back(soup.faces[5]);  // twice, and with two labels
  soup.provenance.push_back(Provenance::Inferred);
  soup.faces.push_back({0, 1, 1});
  soup.provenance.push_back(Provenance::Observed);
  soup.vertices.emplace_back(3, 3, 3);  // belongs to no face
  soup.sigma.push_back(0.1f);
  soup.support.push_back(1);
  const RepairedMesh out = repaired(soup);
  const Certificate certificate = certify(out.mesh);
  EXPECT_TRUE(certificate.passed());
  EXPECT_NEAR(certificate.volume, certify(ball).volume, 1e-9);
  EXPECT_EQ(out.mesh.vertices.size(), ball.vertices.size());
  EXPECT_EQ(out.merged_vertices, 3 * ball.faces.size() - ball.vertices.size());
  EXPECT_EQ(out.turned_faces, turned);
  EXPECT_EQ(out.duplicate_faces, 1U);
  EXPECT_EQ(out.flat_faces, 1U);
  EXPECT_EQ(out.unused_vertices, 1U);
  EXPECT_EQ(out.split_vertices, 0U);
  const auto before = area_by_provenance(ball);
  const auto after = area_by_provenance(out.mesh);
  for (size_t k = 0; k < before.size(); ++k) EXPECT_NEAR(after[k], before[k], 1e-9) << k;
}

TEST(Repaired, MergedVerticesClaimTheLeast) {
  TriangleMesh soup;
  soup.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 0}, {0, -1, 0}};
  soup.faces = {{0, 1, 2}, {3, 4, 5}};
  soup.sigma = {0.1f, std::nanf(""), 0.2f, 0.3f, 0.4f, 0.5f};
  soup.support = {3, 2, 1, 1, 2, 3};
  const TriangleMesh out = repaired(soup).mesh;
  ASSERT_EQ(out.vertices.size(), 4U);
  EXPECT_EQ(out.sigma[0], 0.4f);
  EXPECT_TRUE(std::isnan(out.sigma[1]));
  EXPECT_EQ(out.support[0], 2);
  EXPECT_EQ(out.support[1], 1);
}

TEST(Repaired, CountsColoursThatMergedVerticesLose) {
  TriangleMesh soup;
  soup.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 0}, {0, -1, 0}};
  soup.faces = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_EQ(repaired(soup).other_colors, 0U);
  soup.colors.assign(6, Eigen::Vector3f::Constant(0.5f));
  soup.colors[3].x() = 0.55f;  // as a texture differs from itself
  soup.colors[4].z() = 0.7f;
  const RepairedMesh out = repaired(soup);
  EXPECT_EQ(out.merged_vertices, 2U);
  EXPECT_EQ(out.other_colors, 1U);
  EXPECT_EQ(out.mesh.colors[0], soup.colors[0]);
}

TEST(Repaired, TurnsAClosedSolidOutwards) {
  TriangleMesh cube = test::cube_mesh(1).mesh;
  for (auto& face : cube.faces) std::swap(face[0], face[1]);
  const RepairedMesh out = repaired(cube);
  EXPECT_NEAR(certify(out.mesh).volume, 1, 1e-9);
  EXPECT_EQ(out.turned_faces, 12U);
}

TEST(Repaired, TurnsABodyThatOnlyTheBoxOfAnotherHolds) {
  TriangleMesh mesh = test::l_prism_mesh().mesh;
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  const TriangleMesh cube = test::cube_mesh(0.5).mesh;
  for (const auto& p : cube.vertices) mesh.vertices.push_back(p + Eigen::Vector3f(2, 2, 0.25f));
  for (const auto& f : cube.faces) {
    mesh.faces.push_back({f[1] + first, f[0] + first, f[2] + first});
  }
  const RepairedMesh out = repaired(mesh);
  EXPECT_EQ(out.turned_faces, 12U);
  EXPECT_NEAR(certify(out.mesh).volume, 5.125, 1e-9);
  EXPECT_TRUE(certify(out.mesh).passed());
}

TEST(Repaired, SplitsEdgesOfThreeFaces) {
  TriangleMesh fan;
  fan.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  fan.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  fan.provenance = {Provenance::Observed, Provenance::SingleView, Provenance::Inferred};
  const RepairedMesh out = repaired(fan);
  const Certificate certificate = certify(out.mesh);
  EXPECT_TRUE(certificate.edge_manifold && certificate.vertex_manifold);
  EXPECT_GT(out.split_vertices, 0U);
  EXPECT_EQ(out.mesh.provenance, fan.provenance);
  EXPECT_EQ(out.mesh.faces.size(), 3U);
}

TEST(Repaired, AFlatFaceBesideAnInferredOneClaimsNothing) {
  // A square of two halves, whose diagonal has an extra vertex on one side only, with a flat face
  // in the gap.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0.5f, 0}};
  mesh.faces = {{0, 1, 2}, {0, 2, 4}, {0, 4, 3}, {4, 2, 3}};
  mesh.provenance = {
      Provenance::Inferred, Provenance::Observed, Provenance::Observed, Provenance::Observed};
  const RepairedMesh out = repaired(mesh);
  EXPECT_EQ(out.flat_faces, 1U);
  const auto area = area_by_provenance(out.mesh);
  EXPECT_NEAR(area[size_t(Provenance::Inferred)], 0.5, 1e-6);
  EXPECT_NEAR(area[size_t(Provenance::Observed)], 0.5, 1e-6);
  EXPECT_EQ(certify(out.mesh).self_intersections, 0U);
}

// Faces that cannot be removed are told, whatever else was done.
TEST(Repaired, CountsEveryFaceWithoutArea) {
  // A flat face beside a good one, and a closed body of four points on a line.
  TriangleMesh mesh;
  mesh.vertices = {
      {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5f, 0.5f, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}, {6, 0, 0}};
  mesh.faces = {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}, {4, 6, 7}, {4, 7, 5}, {5, 7, 6}};
  const RepairedMesh out = repaired(mesh);
  size_t left = 0;
  for (const auto& f : out.mesh.faces) {
    const Eigen::Vector3f a = out.mesh.vertices[f[1]] - out.mesh.vertices[f[0]];
    const Eigen::Vector3f b = out.mesh.vertices[f[2]] - out.mesh.vertices[f[0]];
    if (a.cross(b).isZero(0)) ++left;
  }
  EXPECT_EQ(out.flat_left, left);
  EXPECT_EQ(left, 4U);
  EXPECT_EQ(out.flat_faces, 1U);
}

// Two bundles of sheets, each of which cuts all of the other one.
TEST(Repaired, GivesAMeshThatCutsItselfMoreOftenThanCanBeHeld) {
  constexpr uint32_t kSheets = 4600;
  TriangleMesh mesh;
  for (uint32_t i = 0; i < kSheets; ++i) {
    const float at = 0.001f * static_cast<float>(i + 1);
    mesh.vertices.insert(mesh.vertices.end(), {{at, -10, -10}, {at, 10, -10}, {at, 0, 20}});
    mesh.vertices.insert(mesh.vertices.end(), {{-10, at, -9}, {10, at, -9}, {0, at, 21}});
    mesh.faces.push_back({6 * i, 6 * i + 1, 6 * i + 2});
    mesh.faces.push_back({6 * i + 3, 6 * i + 4, 6 * i + 5});
  }
  const RepairedMesh out = repaired(mesh);
  EXPECT_EQ(out.self_intersections, kMostSelfIntersections + 1);
  EXPECT_EQ(out.mesh.faces.size(), size_t{2} * kSheets);
}

TEST(WithoutSelfIntersections, DropsTheFacesThatCut) {
  TriangleMesh mesh = test::cube_mesh(1).mesh;
  const auto n = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0.5f, 0.2f, 0.7f}, {0.6f, 0.2f, 2}, {0.7f, 0.3f, 2}});
  mesh.faces.push_back({n, n + 1, n + 2});
  const TriangleMesh out = without_self_intersections(mesh);
  EXPECT_EQ(out.faces.size(),
            11U);  // without the spike, and the half of the upper side that it pierces
  EXPECT_EQ(certify(out).self_intersections, 0U);
}

TEST(RepeatedVertices, AreCounted) {
  const TriangleMesh ball = test::labelled_sphere();
  EXPECT_EQ(repeated_vertices(ball), 0U);
  TriangleMesh soup;
  for (const auto& f : ball.faces) {
    const auto first = static_cast<uint32_t>(soup.vertices.size());
    for (const uint32_t v : f) soup.vertices.push_back(ball.vertices[v]);
    soup.faces.push_back({first, first + 1, first + 2});
  }
  EXPECT_EQ(repeated_vertices(soup), soup.vertices.size() - ball.vertices.size());
}

}  // namespace
}  // namespace cgs::repair_test
