// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/hole_filling.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/components.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::hole_filling_test {
namespace {

const Eigen::Vector3f kCenter(0.05f, -0.1f, 0.15f);

// The labelled ball without its observed cap and without a few faces elsewhere.
TriangleMesh punctured_ball() {
  const TriangleMesh ball = test::labelled_sphere(32, 48);
  std::vector<uint8_t> keep(ball.faces.size(), 1);
  for (size_t f = 0; f < keep.size(); ++f) {
    const Eigen::Vector3f p = ball.vertices[ball.faces[f][0]] - kCenter;
    if (p.z() > 0.36f || (p - Eigen::Vector3f(0.4f, 0, 0)).norm() < 0.06f) keep[f] = 0;
  }
  return with_faces(ball, keep);
}

TEST(HolesFilled, ClosesABallWithInferredFaces) {
  const TriangleMesh open = punctured_ball();
  const FilledMesh out = holes_filled(open, 10);
  EXPECT_EQ(out.filled, 2U);
  EXPECT_EQ(out.left_open, 0U);
  const Certificate certificate = certify(out.mesh);
  EXPECT_TRUE(certificate.passed());
  EXPECT_NEAR(certificate.volume, certify(test::labelled_sphere(32, 48)).volume, 0.004);
  double patches = 0;
  for (size_t f = 0; f < out.mesh.faces.size(); ++f) {
    if (f < open.faces.size()) {
      EXPECT_EQ(out.mesh.faces[f], open.faces[f]);
      EXPECT_EQ(out.mesh.provenance[f], open.provenance[f]);
    } else {
      EXPECT_EQ(out.mesh.provenance[f], Provenance::Inferred);
    }
  }
  patches = area_by_provenance(out.mesh)[0] - area_by_provenance(open)[0];
  EXPECT_NEAR(patches, out.area, 1e-9);
}

TEST(HolesFilled, NothingIsClaimedOfNewVertices) {
  const TriangleMesh open = punctured_ball();
  const TriangleMesh out = holes_filled(open, 10).mesh;
  ASSERT_GT(out.vertices.size(), open.vertices.size());
  for (size_t v = 0; v < out.vertices.size(); ++v) {
    if (v < open.vertices.size()) {
      EXPECT_EQ(out.vertices[v], open.vertices[v]);
      continue;
    }
    EXPECT_TRUE(std::isnan(out.sigma[v]));
    EXPECT_EQ(out.support[v], 0);
    EXPECT_GT(out.normals[v].dot((out.vertices[v] - kCenter).normalized()), 0.8f);
    // Colours of the ball follow its normals, which vary little along a rim.
    const Eigen::Vector3f along = (out.vertices[v] - kCenter).normalized();
    EXPECT_NEAR((out.colors[v] - (0.5f * along.array() + 0.5f).matrix()).norm(), 0, 0.25) << v;
  }
}

TEST(HolesFilled, LeavesWiderHolesOpen) {
  const TriangleMesh open = punctured_ball();
  const FilledMesh out = holes_filled(open, 0.35);
  EXPECT_EQ(out.filled, 1U);
  EXPECT_EQ(out.left_open, 1U);
  EXPECT_FALSE(certify(out.mesh).closed);
}

TEST(HolesFilled, LeavesHolesWithLongRimsOpenAndCountsThem) {
  const FilledMesh out = holes_filled(punctured_ball(), 10, {}, 12);
  EXPECT_EQ(out.filled, 1U);
  EXPECT_EQ(out.left_open, 1U);
  EXPECT_EQ(out.long_rims, 1U);
}

TEST(HolesFilled, ClosesHolesThatTouchEachForItselfInWhateverOrderFacesCome) {
  TriangleMesh torus = test::torus_mesh(1, 0.4, 24, 12).mesh;
  std::mt19937 random(1);
  for (int attempt = 0; attempt < 5; ++attempt) {
    // Every second of the six faces around vertex 100, around which they are sorted.
    const Eigen::Vector3d center = torus.vertices[100].cast<double>();
    std::vector<std::pair<double, size_t>> around;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (const auto& f : torus.faces) {
      if (std::count(f.begin(), f.end(), 100U) > 0) normal += area_vector(torus, f).normalized();
    }
    const Eigen::Vector3d x = normal.unitOrthogonal();
    const Eigen::Vector3d y = normal.cross(x);
    for (size_t f = 0; f < torus.faces.size(); ++f) {
      const auto& face = torus.faces[f];
      if (std::count(face.begin(), face.end(), 100U) == 0) continue;
      Eigen::Vector3d d = Eigen::Vector3d::Zero();
      for (const uint32_t v : face) d += torus.vertices[v].cast<double>() - center;
      around.emplace_back(std::atan2(d.dot(y), d.dot(x)), f);
    }
    ASSERT_EQ(around.size(), 6U);
    std::sort(around.begin(), around.end());
    std::vector<uint8_t> keep(torus.faces.size(), 1);
    for (size_t i = 0; i < 6; i += 2) keep[around[i].second] = 0;
    const FilledMesh out = holes_filled(with_faces(torus, keep), 10);
    EXPECT_EQ(out.filled, 3U);
    EXPECT_EQ(out.left_open, 0U);
    EXPECT_EQ(out.mesh.faces.size(), torus.faces.size());
    EXPECT_TRUE(certify(out.mesh).passed());
    std::shuffle(torus.faces.begin(), torus.faces.end(), random);
  }
}

TEST(HolesFilled, WithoutProvenanceThereIsNoneAfterwards) {
  TriangleMesh open = punctured_ball();
  open.provenance.clear();
  EXPECT_TRUE(holes_filled(open, 10).mesh.provenance.empty());
}

TEST(HolesFilled, RefusesWhatIsNotManifold) {
  TriangleMesh fan;
  fan.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  fan.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_THROW(holes_filled(fan, 10), NumericalError);
}

}  // namespace
}  // namespace cgs::hole_filling_test
