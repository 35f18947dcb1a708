// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/projection_gradient.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/support/largest.h"
#include "tests/support/oblique_camera.h"

namespace cgs::projection_gradient_test {
namespace {

using test::oblique_camera;

constexpr SplatGradient kGradient{
    .u = 0.7, .v = -1.1, .cov_xx = 0.13, .cov_xy = -0.21, .cov_yy = 0.08, .depth = 3};

/// A Gaussian in double.
struct Shape {
  Eigen::Vector3d position;
  Eigen::Vector3d scale;
  Eigen::Vector4d rotation;  // (w, x, y, z), of any length
};

// The loss whose derivatives by the footprint are kGradient, by the formula of Zwicker et al.; the
// dilation adds a constant.
double loss_of(const Shape& shape) {
  const Camera camera = oblique_camera();
  const Eigen::Matrix3d W = camera.world_from_cam.linear().transpose();
  const Eigen::Vector3d t = W * (shape.position - camera.center());
  const double a = std::clamp(t.x() / t.z(),
                              (-0.15 * camera.width - camera.cx) / camera.fx,
                              (1.15 * camera.width - camera.cx) / camera.fx);
  const double b = std::clamp(t.y() / t.z(),
                              (-0.15 * camera.height - camera.cy) / camera.fy,
                              (1.15 * camera.height - camera.cy) / camera.fy);
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx / t.z(), 0, -camera.fx / t.z() * a, 0, camera.fy / t.z(), -camera.fy / t.z() * b;
  const Eigen::Vector4d& q = shape.rotation;
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().matrix();
  const Eigen::Matrix3d squares = shape.scale.cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d sigma = R * squares * R.transpose();
  const Eigen::Matrix2d C = J * W * sigma * W.transpose() * J.transpose();
  return kGradient.u * (camera.fx * t.x() / t.z() + camera.cx) +
         kGradient.v * (camera.fy * t.y() / t.z() + camera.cy) + kGradient.cov_xx * C(0, 0) +
         kGradient.cov_xy * C(0, 1) + kGradient.cov_yy * C(1, 1) + kGradient.depth * t.z();
}

// By one number of a shape, as `number` finds it.
double difference(Shape shape, const std::function<double&(Shape&)>& number) {
  constexpr double kStep = 1e-6;
  double& value = number(shape);
  const double at = value;
  value = at + kStep;
  const double above = loss_of(shape);
  value = at - kStep;
  return (above - loss_of(shape)) / (2 * kStep);
}

template <int N>
void expect_near(const Eigen::Matrix<double, N, 1>& got,
                 const Shape& shape,
                 const std::function<double&(Shape&, int)>& number) {
  Eigen::Matrix<double, N, 1> truth;
  double largest = 0;
  for (int k = 0; k < N; ++k) {
    truth[k] = difference(shape, [&](Shape& s) -> double& { return number(s, k); });
    largest = test::largest(largest, std::abs(truth[k]));
  }
  EXPECT_GT(largest, 1e-3);
  for (int k = 0; k < N; ++k) EXPECT_NEAR(got[k], truth[k], 1e-5 * largest) << k;
}

Gaussians one_gaussian(double u, double v, const Eigen::Vector3f& scale) {
  Gaussians g;
  g.position.push_back(oblique_camera().unproject(u, v, 0.7).cast<float>());
  g.scale.push_back(scale);
  g.rotation.emplace_back(0.6f, -0.3f, 0.5f, 0.2f);
  g.opacity.push_back(0.8f);
  g.sh.emplace_back(0, 0, 0);
  return g;
}

Shape shape_of(const Gaussians& g) {
  return {g.position[0].cast<double>(), g.scale[0].cast<double>(), g.rotation[0].cast<double>()};
}

Splat drawn(const Gaussians& g) {
  const ProjectedGaussians projected = project_gaussians(g, oblique_camera());
  EXPECT_EQ(projected.fate[0], SplatFate::Drawn);
  return projected.splats[0];
}

double& position_of(Shape& s, int k) { return s.position[k]; }
double& scale_of(Shape& s, int k) { return s.scale[k]; }
double& rotation_of(Shape& s, int k) { return s.rotation[k]; }

void expect_ball(const Gaussians& g) {
  const Shape shape = shape_of(g);
  const BallGradient got =
      ball_gradient(projection_view(oblique_camera()), drawn(g), g.scale[0].x(), kGradient);
  expect_near<3>(got.position, shape, position_of);
  double of_radius = 0;
  for (int k = 0; k < 3; ++k) {
    of_radius += difference(shape, [k](Shape& s) -> double& { return s.scale[k]; });
  }
  EXPECT_NEAR(got.radius, of_radius, 1e-5 * std::abs(of_radius));
}

void expect_ellipsoid(const Gaussians& g) {
  const Shape shape = shape_of(g);
  const EllipsoidGradient got = ellipsoid_gradient(
      projection_view(oblique_camera()), drawn(g), g.scale[0], g.rotation[0], kGradient);
  expect_near<3>(got.position, shape, position_of);
  const ShapeGradient of_shape = shape_gradient(g.scale[0], g.rotation[0], got.covariance);
  expect_near<3>(of_shape.scale, shape, scale_of);
  expect_near<4>(of_shape.rotation, shape, rotation_of);
}

const Eigen::Vector3f kRound = Eigen::Vector3f::Constant(0.06f);
const Eigen::Vector3f kLong(0.03f, 0.15f, 0.07f);
constexpr double kBeyond = 43.5;  // columns; slopes are clamped at 1.15 * 37

TEST(ProjectionGradient, OfABallIsThatOfDifferences) { expect_ball(one_gaussian(9, 17, kRound)); }

TEST(ProjectionGradient, OfAnEllipsoidIsThatOfDifferences) {
  expect_ellipsoid(one_gaussian(9, 17, kLong));
}

TEST(ProjectionGradient, KnowsThatSlopesAreClampedBesideThePicture) {
  expect_ball(one_gaussian(kBeyond, 8, 3 * kRound));
  expect_ellipsoid(one_gaussian(kBeyond, 8, 3 * kLong));
}

TEST(ProjectionGradient, TakesQuaternionsOfAnyLength) {
  Gaussians g = one_gaussian(25, 8, kLong);
  g.rotation[0] *= 3 / g.rotation[0].norm();
  expect_ellipsoid(g);
}

// Both ways, where scales are equal.
TEST(ProjectionGradient, OfABallIsThatOfARoundEllipsoid) {
  const Gaussians g = one_gaussian(9, 17, kRound);
  const ProjectionView view = projection_view(oblique_camera());
  const BallGradient ball = ball_gradient(view, drawn(g), kRound.x(), kGradient);
  const EllipsoidGradient other =
      ellipsoid_gradient(view, drawn(g), kRound, g.rotation[0], kGradient);
  EXPECT_LT((ball.position - other.position).norm(), 1e-6 * ball.position.norm());
  const ShapeGradient shape = shape_gradient(kRound, g.rotation[0], other.covariance);
  EXPECT_NEAR(shape.scale.sum(), ball.radius, 1e-6 * std::abs(ball.radius));
}

}  // namespace
}  // namespace cgs::projection_gradient_test
