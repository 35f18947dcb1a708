// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/hull.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/solid_meshes.h"

namespace cgs::hull_test {
namespace {

TEST(ConvexHull, OfACloudInACubeIsTheCube) {
  TriangleMesh cloud;
  for (const auto& p : test::cube_mesh(1).mesh.vertices) cloud.vertices.push_back(p);
  for (int i = 0; i < 40; ++i) cloud.vertices.emplace_back(0.3f, 0.5f, 0.02f * float(i));
  for (size_t v = 0; v < cloud.vertices.size(); ++v) cloud.sigma.push_back(float(v));
  const TriangleMesh hull = convex_hull(cloud);
  EXPECT_EQ(hull.vertices.size(), 8U);
  EXPECT_EQ(hull.sigma, (std::vector<float>{0, 1, 2, 3, 4, 5, 6, 7}));
  const Certificate certificate = certify(hull);
  EXPECT_TRUE(certificate.passed());
  EXPECT_NEAR(certificate.volume, 1, 1e-9);
  EXPECT_NEAR(certificate.inferred_area, 6, 1e-9);
}

TEST(ConvexHull, FacesThatWereThereKeepTheirLabels) {
  const TriangleMesh ball = test::labelled_sphere();
  const auto before = area_by_provenance(ball);
  const TriangleMesh hull = convex_hull(ball);
  const auto after = area_by_provenance(hull);
  EXPECT_TRUE(certify(hull).passed());
  for (const Provenance label : {Provenance::Observed, Provenance::SingleView}) {
    // Quads of the ball are flat but for rounding, so a diagonal may run the other way.
    EXPECT_LE(after[size_t(label)], before[size_t(label)] + 1e-9);
    EXPECT_GT(after[size_t(label)], 0.2 * before[size_t(label)]);
  }
}

TEST(ConvexHull, RefusesPointsInAPlane) {
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.2f, 0.3f, 0}};
  EXPECT_THROW(convex_hull(flat), NumericalError);
  EXPECT_THROW(convex_hull({}), NumericalError);
}

}  // namespace
}  // namespace cgs::hull_test
