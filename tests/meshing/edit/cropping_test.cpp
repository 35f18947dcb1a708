// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/cropping.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "meshing/mesh/certificate.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::cropping_test {
namespace {

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const double a : area_by_provenance(mesh)) sum += a;
  return sum;
}

TEST(CroppedByPlane, LeavesTheAreaOfACap) {
  const double radius = 0.4;
  const TriangleMesh ball = test::sphere_mesh(radius, 128, 256).mesh;
  for (const double height : {-0.3, 0.0, 0.25}) {
    const Eigen::Vector3d normal = Eigen::Vector3d(1, 2, -2) / 3;
    const TriangleMesh cap = cropped_by_plane(ball, height * normal, 5 * normal);
    EXPECT_NEAR(area(cap), 2 * std::numbers::pi * radius * (radius - height), 1e-3);
    const Certificate certificate = certify(cap);
    EXPECT_TRUE(certificate.edge_manifold && certificate.vertex_manifold);
    EXPECT_EQ(certificate.self_intersections, 0U);
    for (const auto& p : cap.vertices) EXPECT_GE(p.cast<double>().dot(normal), height - 1e-6);
    // One rim: Euler number of a disc.
    EXPECT_EQ(certificate.euler_number, 1);
  }
}

TEST(CroppedByPlane, SplitsNothingWhereItPassesThroughVertices) {
  const TriangleMesh cube =
      test::grid_mesh(4, 4, [](double s, double t) { return Eigen::Vector3d(s, t, 0); }).mesh;
  const TriangleMesh half = cropped_by_plane(cube, {0.5, 0, 0}, {1, 0, 0});
  EXPECT_EQ(half.faces.size(), 16U);
  EXPECT_EQ(half.vertices.size(), 15U);
}

// Where sine and cosine give 6e-16 for 0.
TEST(CroppedByPlane, SplitsNothingBesideVerticesAtZeroButForRounding) {
  TriangleMesh mesh = test::torus_mesh(20, 5, 48, 24).mesh;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    float& z = mesh.vertices[i].z();
    if (std::abs(z) < 1e-5f) z = i % 2 == 0 ? 6e-16f : -6e-16f;
  }
  const TriangleMesh half = cropped_by_plane(mesh, {0, 0, 0}, {0, 0, 1});
  EXPECT_EQ(half.faces.size(), mesh.faces.size() / 2);
}

TEST(CroppedByPlane, BothSidesTogetherHaveTheAreaOfEveryLabel) {
  const TriangleMesh ball = test::labelled_sphere();
  const Eigen::Vector3d point(0.06, -0.1, 0.13);
  const auto above = area_by_provenance(cropped_by_plane(ball, point, {1, 0.3, 1}));
  const auto below = area_by_provenance(cropped_by_plane(ball, point, {-1, -0.3, -1}));
  const auto whole = area_by_provenance(ball);
  for (size_t k = 0; k < whole.size(); ++k) EXPECT_NEAR(above[k] + below[k], whole[k], 1e-6);
}

TEST(CroppedByBox, LeavesWhatLiesInIt) {
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, 0.25, 0.25), Eigen::Vector3d(0.5, 2, 0.5));
  // Of the sides x = 0 and y = 1, and nothing of the others.
  EXPECT_NEAR(area(cropped_by_box(cube, box)), 0.75 * 0.25 + 0.5 * 0.25, 1e-6);
  const Eigen::AlignedBox3d far(Eigen::Vector3d(5, 5, 5), Eigen::Vector3d(6, 6, 6));
  EXPECT_TRUE(cropped_by_box(cube, far).vertices.empty());
}

TEST(CroppedByBox, TakesPointClouds) {
  TriangleMesh cloud;
  cloud.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  cloud.sigma = {1, 2, 3};
  const Eigen::AlignedBox3d box(Eigen::Vector3d(0.5, 0.5, 0.5), Eigen::Vector3d(1, 1, 1));
  const TriangleMesh out = cropped_by_box(cloud, box);
  ASSERT_EQ(out.vertices.size(), 1U);
  EXPECT_EQ(out.sigma[0], 2);
}

TEST(CroppedByBall, KeepsFacesWhoseCornersAllLieInIt) {
  const TriangleMesh ball = test::labelled_sphere();
  const Eigen::Vector3d center(0.05, -0.1, 0.55);
  const TriangleMesh out = cropped_by_ball(ball, center, 0.3);
  size_t expected = 0;
  for (const auto& f : ball.faces) {
    bool inside = true;
    for (const uint32_t v : f) {
      inside = inside && (ball.vertices[v].cast<double>() - center).norm() <= 0.3;
    }
    expected += inside ? 1 : 0;
  }
  EXPECT_EQ(out.faces.size(), expected);
  EXPECT_GT(expected, 10U);
}

}  // namespace
}  // namespace cgs::cropping_test
