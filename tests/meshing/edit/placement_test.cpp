// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/placement.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/certificate.h"
#include "tests/support/sample_mesh.h"

namespace cgs::placement_test {
namespace {

TEST(MoveMesh, MovesWorldPointsAndKeepsTheUnit) {
  const TriangleMesh ball = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  const Eigen::Vector3d zero(1000, -2000, 500);
  Eigen::Affine3d motion = Eigen::Translation3d(1e6, 5, -3) *
                           Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()) *
                           Eigen::Scaling(2.5);
  TriangleMesh moved = ball;
  Frame to = frame;
  move_mesh(moved, to, motion, zero);
  EXPECT_EQ(to.metres_per_unit, frame.metres_per_unit);
  EXPECT_EQ(to.scale_source, frame.scale_source);
  for (size_t v = 0; v < ball.vertices.size(); ++v) {
    const Eigen::Vector3d expected =
        motion * (frame.world_from_internal(ball.vertices[v].cast<double>()) - zero) + zero;
    const Eigen::Vector3d found = to.world_from_internal(moved.vertices[v].cast<double>());
    EXPECT_NEAR((found - expected).norm(), 0, 1e-5);  // 1e-7 of the extent, a million away
    const Eigen::Vector3f normal = motion.rotation().cast<float>() * ball.normals[v];
    EXPECT_NEAR((moved.normals[v] - normal).norm(), 0, 1e-5);
    if (std::isnan(ball.sigma[v])) continue;
    EXPECT_NEAR(moved.sigma[v] * to.scale, 2.5 * ball.sigma[v] * frame.scale, 1e-5);
  }
  // What is written is near the file's own origin.
  EXPECT_LT(to.file_from_internal(moved.vertices[0].cast<double>()).norm(), 1000);
}

TEST(MoveMesh, AMirroredSolidStaysASolid) {
  TriangleMesh ball = test::labelled_sphere();
  Frame frame;
  const double volume = certify(ball).volume;
  move_mesh(ball, frame, Eigen::Affine3d(Eigen::Scaling(-1.0, 1.0, 2.0)), {0, 0, 0});
  const Certificate certificate = certify(ball);
  EXPECT_TRUE(certificate.passed());
  EXPECT_NEAR(certificate.volume * std::pow(frame.scale, 3), 2 * volume, 1e-5);
}

TEST(MoveMesh, RefusesToFlatten) {
  TriangleMesh ball = test::labelled_sphere();
  Frame frame;
  EXPECT_THROW(move_mesh(ball, frame, Eigen::Affine3d(Eigen::Scaling(1.0, 1.0, 0.0)), {0, 0, 0}),
               InvalidInput);
  Eigen::Affine3d broken = Eigen::Affine3d::Identity();
  broken(0, 3) = std::nan("");
  EXPECT_THROW(move_mesh(ball, frame, broken, {0, 0, 0}), InvalidInput);
}

TEST(MoveToFrame, MatchesUnitsWhereBothAreKnown) {
  TriangleMesh mesh;
  mesh.vertices = {{1, 2, 3}};
  mesh.sigma = {0.5f};
  Frame centimetres;
  centimetres.metres_per_unit = 0.01;
  Frame metres;
  metres.metres_per_unit = 1;
  metres.origin = {1, 0, 0};
  metres.scale = 2;
  move_to_frame(mesh, centimetres, metres);
  EXPECT_NEAR((mesh.vertices[0] - Eigen::Vector3f(-0.495f, 0.01f, 0.015f)).norm(), 0, 1e-6);
  EXPECT_FLOAT_EQ(mesh.sigma[0], 0.0025f);
}

}  // namespace
}  // namespace cgs::placement_test
