// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/remeshing.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/mesh_distance.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::remeshing_test {
namespace {

TEST(Subdivided, LeavesTheSurfaceWhereItIs) {
  const TriangleMesh ball = test::labelled_sphere();
  const TriangleMesh out = subdivided(ball, 2);
  EXPECT_EQ(out.faces.size(), 16 * ball.faces.size());
  const Certificate before = certify(ball);
  const Certificate after = certify(out);
  EXPECT_TRUE(after.passed());
  EXPECT_NEAR(after.volume, before.volume, 1e-6);
  const auto area = area_by_provenance(ball);
  const auto area_after = area_by_provenance(out);
  for (size_t k = 0; k < area.size(); ++k) EXPECT_NEAR(area_after[k], area[k], 1e-5);
  EXPECT_THROW(subdivided(ball, 30), LimitError);
}

TEST(Remeshed, GivesEqualSidesAndKeepsEveryLabelInItsPlace) {
  const TriangleMesh ball = test::labelled_sphere(48, 64);
  constexpr double kEdge = 0.03;
  const TriangleMesh out = remeshed(ball, kEdge);
  EXPECT_TRUE(certify(out).passed());
  EXPECT_LT(mesh_distance(out, ball, 20'000).hausdorff(), 0.002);
  EXPECT_GT(certify(out).smallest_angle, 0.2);
  size_t odd = 0;
  for (const auto& f : out.faces) {
    for (size_t k = 0; k < 3; ++k) {
      const float length = (out.vertices[f[k]] - out.vertices[f[(k + 1) % 3]]).norm();
      odd += length < 0.5 * kEdge || length > 1.6 * kEdge ? 1 : 0;
    }
  }
  EXPECT_LT(double(odd), 0.02 * 3 * double(out.faces.size()));
  const auto area = area_by_provenance(ball);
  const auto area_after = area_by_provenance(out);
  for (size_t k = 0; k < area.size(); ++k) EXPECT_NEAR(area_after[k], area[k], 0.01 * area[k]) << k;
}

TEST(Remeshed, VerticesStateWhatTheSurfaceUnderThemDoes) {
  const TriangleMesh ball = test::labelled_sphere(48, 64);
  const TriangleMesh out = remeshed(ball, 0.03);
  const Eigen::Vector3d center(0.05, -0.1, 0.15);
  size_t sure = 0;
  for (size_t v = 0; v < out.vertices.size(); ++v) {
    const Eigen::Vector3d d = (out.vertices[v].cast<double>() - center).normalized();
    const double polar = std::acos(std::clamp(d.z(), -1.0, 1.0));
    if (polar > 2.01) EXPECT_TRUE(std::isnan(out.sigma[v])) << v;
    if (polar < 1.9) EXPECT_NEAR(out.sigma[v], 0.001 + 0.002 * polar, 5e-5) << v;
    if (polar < 1.9) ++sure;
    EXPECT_NEAR((out.colors[v].cast<double>() - (0.5 * d.array() + 0.5).matrix()).norm(), 0, 0.02);
  }
  EXPECT_GT(sure, 300U);
}

TEST(Remeshed, RefusesWhatMightNotEnd) {
  TriangleMesh crossed = test::cube_mesh(1).mesh;
  crossed.vertices.insert(crossed.vertices.end(),
                          {{0.5f, 0.2f, 0.7f}, {0.6f, 0.2f, 2}, {0.7f, 0.3f, 2}});
  crossed.faces.push_back({8, 9, 10});
  EXPECT_THROW(remeshed(crossed, 0.1), NumericalError);
  EXPECT_THROW(remeshed(test::cube_mesh(1).mesh, 1e-6), LimitError);
  EXPECT_THROW(remeshed(test::cube_mesh(1).mesh, 0), InvalidInput);
}

TEST(Remeshed, NamesSheetsThatMeetInAVertexAsACauseOfTheRefusal) {
  TriangleMesh mesh;  // two tetrahedra
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  for (const uint32_t k : {0U, 3U}) {
    mesh.faces.push_back({0, k + 2, k + 1});
    mesh.faces.push_back({0, k + 1, k + 3});
    mesh.faces.push_back({0, k + 3, k + 2});
    mesh.faces.push_back({k + 1, k + 2, k + 3});
  }
  try {
    remeshed(mesh, 0.5);
    ADD_FAILURE() << "two fans around one vertex";
  } catch (const NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("single vertex"), std::string::npos) << error.what();
  }
}

TEST(Remeshed, CutsOffNoCorner) {
  const TriangleMesh cube = test::cube_mesh(1).mesh;
  const TriangleMesh out = remeshed(cube, 0.3);
  EXPECT_TRUE(certify(out).passed());
  EXPECT_GT(out.faces.size(), cube.faces.size());
  EXPECT_NEAR(certify(out).volume, 1, 1e-4);
  EXPECT_LT(mesh_distance(out, cube, 20'000).hausdorff(), 1e-3);
}

}  // namespace
}  // namespace cgs::remeshing_test
