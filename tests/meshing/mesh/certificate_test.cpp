// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/certificate.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/solid_meshes.h"

namespace cgs::certificate_test {
namespace {

using Eigen::Vector3f;

// Axis-aligned box, outward faces.
TriangleMesh cube(const Vector3f& low, const Vector3f& high) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.emplace_back((k & 1) != 0 ? high.x() : low.x(),
                               (k & 2) != 0 ? high.y() : low.y(),
                               (k & 4) != 0 ? high.z() : low.z());
  }
  mesh.faces = {{0, 2, 3},
                {0, 3, 1},
                {4, 5, 7},
                {4, 7, 6},
                {0, 1, 5},
                {0, 5, 4},
                {2, 6, 7},
                {2, 7, 3},
                {0, 4, 6},
                {0, 6, 2},
                {1, 3, 7},
                {1, 7, 5}};
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& more, bool flipped = false) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), more.vertices.begin(), more.vertices.end());
  for (auto f : more.faces) {
    if (flipped) std::swap(f[1], f[2]);
    mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
}

TriangleMesh torus(double big, double small, int n) {
  TriangleMesh mesh;
  const auto at = [n](int i, int j) { return static_cast<uint32_t>((i % n) * n + j % n); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double u = 2 * M_PI * i / n;
      const double v = 2 * M_PI * j / n;
      const double r = big + small * std::cos(v);
      mesh.vertices.push_back(
          Eigen::Vector3d(r * std::cos(u), r * std::sin(u), small * std::sin(v)).cast<float>());
      mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

TEST(Certify, PassesACubeAndMeasuresIt) {
  const Certificate c = certify(cube({0, 0, 0}, {1, 2, 3}));
  EXPECT_TRUE(c.passed());
  EXPECT_DOUBLE_EQ(c.volume, 6);
  EXPECT_DOUBLE_EQ(c.area, 22);
  EXPECT_DOUBLE_EQ(c.inferred_area, 22);
  EXPECT_EQ(c.components, 1U);
  EXPECT_EQ(c.genus, 0);
}

TEST(Certify, SplitsTheAreaByLabel) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  mesh.provenance.assign(12, Provenance::Observed);
  mesh.provenance[0] = mesh.provenance[1] = mesh.provenance[2] = Provenance::Estimated;
  mesh.provenance[3] = Provenance::Inferred;
  const Certificate c = certify(mesh);
  EXPECT_DOUBLE_EQ(c.observed_area, 4);
  EXPECT_DOUBLE_EQ(c.estimated_area, 1.5);
  EXPECT_DOUBLE_EQ(c.inferred_area, 0.5);
  EXPECT_DOUBLE_EQ(c.single_view_area + c.interpolated_area + c.virtual_area, 0);
}

TEST(Certify, MeasuresFarFromTheOriginAsNearIt) {
  const Vector3f far(4096, -8192, 2048);
  const Certificate c = certify(cube(far, far + Vector3f(1, 2, 3)));
  EXPECT_DOUBLE_EQ(c.volume, 6);
  EXPECT_DOUBLE_EQ(c.area, 22);
}

TEST(Certify, FindsAMissingFace) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  mesh.faces.pop_back();
  const Certificate c = certify(mesh);
  EXPECT_FALSE(c.closed);
  EXPECT_TRUE(c.edge_manifold);
  EXPECT_TRUE(c.vertex_manifold);
  EXPECT_FALSE(c.passed());
}

TEST(Certify, FindsAFlippedFace) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  std::swap(mesh.faces[3][0], mesh.faces[3][1]);
  const Certificate c = certify(mesh);
  EXPECT_TRUE(c.closed);
  EXPECT_FALSE(c.oriented_outward);
}

TEST(Certify, FindsAMeshTurnedInsideOut) {
  TriangleMesh mesh;
  append(mesh, cube({0, 0, 0}, {1, 1, 1}), true);
  const Certificate c = certify(mesh);
  EXPECT_FALSE(c.oriented_outward);
  EXPECT_DOUBLE_EQ(c.volume, -1);
}

TEST(Certify, AllowsACavityButNotASecondBodyInsideOut) {
  TriangleMesh hollow = cube({0, 0, 0}, {4, 4, 4});
  append(hollow, cube({1, 1, 1}, {2, 2, 2}), true);
  EXPECT_TRUE(certify(hollow).passed());
  EXPECT_DOUBLE_EQ(certify(hollow).volume, 63);
  TriangleMesh wrong = cube({0, 0, 0}, {4, 4, 4});
  append(wrong, cube({5, 5, 5}, {6, 6, 6}), true);
  EXPECT_FALSE(certify(wrong).oriented_outward);
}

TEST(Certify, ABodyInsideOutBesideTheMatterIsNoCavity) {
  const TriangleMesh prism = test::l_prism_mesh().mesh;
  EXPECT_TRUE(certify(prism).passed());
  EXPECT_NEAR(certify(prism).volume, 5, 1e-12);
  // The box around the prism has this one in it, its matter does not.
  TriangleMesh wrong = prism;
  append(wrong, cube({1.5f, 1.5f, 0.25f}, {2.5f, 2.5f, 0.75f}), true);
  EXPECT_TRUE(certify(wrong).closed);
  EXPECT_FALSE(certify(wrong).oriented_outward);
  TriangleMesh beside = prism;
  append(beside, cube({1.5f, 1.5f, 0.25f}, {2.5f, 2.5f, 0.75f}));
  EXPECT_TRUE(certify(beside).passed());
  TriangleMesh hollow = prism;
  append(hollow, cube({0.25f, 1.5f, 0.25f}, {0.75f, 2.5f, 0.75f}), true);
  EXPECT_TRUE(certify(hollow).passed());
  append(hollow, cube({1.5f, 1.5f, 0.25f}, {2.5f, 2.5f, 0.75f}), true);
  EXPECT_FALSE(certify(hollow).oriented_outward);
}

TEST(Certify, ACavityMayTouchAndMayLieBesideABodyWithinABody) {
  TriangleMesh touching = cube({0, 0, 0}, {4, 4, 4});
  TriangleMesh tip;
  tip.vertices = {{2, 2, 4}, {2, 1, 3}, {1, 3, 3}, {3, 3, 3}};  // the first on the upper side
  tip.faces = {{0, 1, 3}, {0, 2, 1}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_GT(certify(tip).volume, 0);
  append(touching, tip, true);
  EXPECT_TRUE(certify(touching).oriented_outward);
  TriangleMesh nested = cube({0, 0, 0}, {4, 4, 4});
  append(nested, cube({1, 1, 1}, {3, 2, 2}));
  append(nested, cube({1, 2.5f, 1}, {3, 3, 2}), true);
  EXPECT_TRUE(certify(nested).oriented_outward);
}

TEST(Certify, FindsTwoCubesThatShareOneVertex) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  append(mesh, cube({1, 1, 1}, {2, 2, 2}));
  for (auto& face : mesh.faces) {
    for (auto& v : face) v = v == 8 ? 7 : v;
  }
  const Certificate c = certify(mesh);
  EXPECT_TRUE(c.closed);
  EXPECT_TRUE(c.edge_manifold);
  EXPECT_FALSE(c.vertex_manifold);
}

TEST(Certify, FindsAnEdgeWithThreeFaces) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(-1.0f, -1.0f, 0.5f);
  mesh.faces.push_back({0, 4, 8});
  EXPECT_FALSE(certify(mesh).edge_manifold);
}

TEST(Certify, CountsSelfIntersections) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  append(mesh, cube({0.5f, 0.5f, 0.5f}, {1.5f, 1.5f, 1.5f}));
  const Certificate c = certify(mesh);
  EXPECT_TRUE(c.closed);
  EXPECT_GT(c.self_intersections, 0U);
  EXPECT_FALSE(c.passed());
}

TEST(Certify, CountsHandles) {
  EXPECT_EQ(certify(torus(2, 0.5, 24)).genus, 1);
  EXPECT_TRUE(certify(torus(2, 0.5, 24)).passed());
  TriangleMesh two = torus(2, 0.5, 24);
  append(two, cube({5, 5, 5}, {6, 6, 6}));
  EXPECT_EQ(certify(two).genus, 1);
  EXPECT_EQ(certify(two).components, 2U);
}

TEST(Certify, DoesNotPassAnEmptyMesh) { EXPECT_FALSE(certify({}).passed()); }

TEST(IsClosed, AsksForTwoFacesAtEveryEdgeAndForOneFanAtEveryVertex) {
  TriangleMesh mesh = cube({0, 0, 0}, {1, 1, 1});
  EXPECT_TRUE(is_closed_mesh(mesh));
  EXPECT_TRUE(is_closed_manifold(mesh));
  TriangleMesh open = mesh;
  open.faces.pop_back();
  EXPECT_FALSE(is_closed_mesh(open));
  EXPECT_FALSE(is_closed_manifold(open));
  append(mesh, cube({1, 1, 1}, {2, 2, 2}));
  for (auto& face : mesh.faces) {
    for (auto& v : face) v = v == 8 ? 7 : v;
  }
  EXPECT_TRUE(is_closed_mesh(mesh));
  EXPECT_FALSE(is_closed_manifold(mesh)) << "two cubes at one vertex";
  EXPECT_FALSE(is_closed_mesh({}));
}

TEST(Certificate, TellsEulerNumberAndSmallestAngle) {
  TriangleMesh mesh;
  EXPECT_EQ(certify(mesh).euler_number, 0);
  EXPECT_EQ(certify(mesh).smallest_angle, 0);
  // A right triangle with legs 1 and 2, beside it an unused vertex.
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {5, 5, 5}};
  mesh.faces = {{0, 1, 2}};
  EXPECT_EQ(certify(mesh).euler_number, 1);
  EXPECT_NEAR(certify(mesh).smallest_angle, std::atan(0.5), 1e-12);
}

}  // namespace
}  // namespace cgs::certificate_test
