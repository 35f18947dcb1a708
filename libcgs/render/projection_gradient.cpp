// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/projection_gradient.h"

#include <algorithm>

namespace cgs {

namespace {

// The point where the perspective map is linearised.
struct Slopes {
  double inverse_z;
  double raw_x, raw_y;  // x/z, y/z
  double a, b;          // the same, clamped
  double jx, jy;        // fx / z, fy / z

  Slopes(const ProjectionView& view, const Splat& splat)
      : inverse_z(1 / double(splat.depth)),
        raw_x((splat.u - view.camera.cx) / view.camera.fx),
        raw_y((splat.v - view.camera.cy) / view.camera.fy),
        a(std::clamp(raw_x, view.min_slope[0], view.max_slope[0])),
        b(std::clamp(raw_y, view.min_slope[1], view.max_slope[1])),
        jx(view.camera.fx * inverse_z),
        jy(view.camera.fy * inverse_z) {}
};

// World axes, from the derivatives with respect to the clamped slopes and, through the covariance
// alone, to z.
Eigen::Vector3d of_position(const ProjectionView& view,
                            const Slopes& at,
                            const SplatGradient& gradient,
                            const Eigen::Vector3d& of_a_b_z) {
  const double of_x = view.camera.fx * gradient.u + (at.a == at.raw_x ? of_a_b_z[0] : 0);
  const double of_y = view.camera.fy * gradient.v + (at.b == at.raw_y ? of_a_b_z[1] : 0);
  const Eigen::Vector3d in_cam(
      of_x * at.inverse_z,
      of_y * at.inverse_z,
      of_a_b_z[2] + gradient.depth - (at.raw_x * of_x + at.raw_y * of_y) * at.inverse_z);
  return view.cam_from_world.transpose() * in_cam;
}

// dL/dq of a unit quaternion (w, x, y, z) from dL/dR, along the sphere.
Eigen::Vector4d of_unit_quaternion(const Eigen::Vector4d& q, const Eigen::Matrix3d& G) {
  const double w = q[0];
  const double x = q[1];
  const double y = q[2];
  const double z = q[3];
  const Eigen::Vector4d out(
      z * (G(1, 0) - G(0, 1)) + y * (G(0, 2) - G(2, 0)) + x * (G(2, 1) - G(1, 2)),
      y * (G(0, 1) + G(1, 0)) + z * (G(0, 2) + G(2, 0)) + w * (G(2, 1) - G(1, 2)) -
          2 * x * (G(1, 1) + G(2, 2)),
      x * (G(0, 1) + G(1, 0)) + z * (G(1, 2) + G(2, 1)) + w * (G(0, 2) - G(2, 0)) -
          2 * y * (G(0, 0) + G(2, 2)),
      x * (G(0, 2) + G(2, 0)) + y * (G(1, 2) + G(2, 1)) + w * (G(1, 0) - G(0, 1)) -
          2 * z * (G(0, 0) + G(1, 1)));
  return 2 * (out - q * q.dot(out));
}

}  // namespace

BallGradient ball_gradient(const ProjectionView& view,
                           const Splat& splat,
                           float radius,
                           const SplatGradient& gradient) {
  const Slopes at(view, splat);
  const double r = radius;
  const double xx = at.jx * gradient.cov_xx;
  const double xy = at.jx * at.jy * gradient.cov_xy;
  const double yy = at.jy * gradient.cov_yy;
  // (J J^T, dL/dC) as a sum over the entries: the derivative with respect to r^2.
  const double of_square =
      at.jx * xx * (1 + at.a * at.a) + xy * at.a * at.b + at.jy * yy * (1 + at.b * at.b);
  const Eigen::Vector3d of_a_b_z(r * r * (2 * at.jx * xx * at.a + xy * at.b),
                                 r * r * (2 * at.jy * yy * at.b + xy * at.a),
                                 -2 * r * r * of_square * at.inverse_z);
  return {of_position(view, at, gradient, of_a_b_z), 2 * r * of_square};
}

EllipsoidGradient ellipsoid_gradient(const ProjectionView& view,
                                     const Splat& splat,
                                     const Eigen::Vector3f& scale,
                                     const Eigen::Vector4f& rotation,
                                     const SplatGradient& gradient) {
  const Slopes at(view, splat);
  const Eigen::Vector4d q = rotation.cast<double>().normalized();
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  // As columns, in the camera.
  const Eigen::Matrix3d axes = view.cam_from_world * R * scale.cast<double>().asDiagonal();
  const Eigen::RowVector3d in_x = at.jx * (axes.row(0) - at.a * axes.row(2));
  const Eigen::RowVector3d in_y = at.jy * (axes.row(1) - at.b * axes.row(2));
  // C = M M^T with rows in_x, in_y.
  const Eigen::RowVector3d of_in_x = 2 * gradient.cov_xx * in_x + gradient.cov_xy * in_y;
  const Eigen::RowVector3d of_in_y = 2 * gradient.cov_yy * in_y + gradient.cov_xy * in_x;
  const Eigen::Vector3d of_a_b_z(-at.jx * of_in_x.dot(axes.row(2)),
                                 -at.jy * of_in_y.dot(axes.row(2)),
                                 -(in_x.dot(of_in_x) + in_y.dot(of_in_y)) * at.inverse_z);
  EllipsoidGradient out;
  out.position = of_position(view, at, gradient, of_a_b_z);
  // The image covariance is that of x = gx . p, y = gy . p for points p in the world.
  const Eigen::Matrix3d& W = view.cam_from_world;
  const Eigen::RowVector3d gx = at.jx * (W.row(0) - at.a * W.row(2));
  const Eigen::RowVector3d gy = at.jy * (W.row(1) - at.b * W.row(2));
  const auto of = [&](int i, int j) {
    return gradient.cov_xx * gx[i] * gx[j] + gradient.cov_yy * gy[i] * gy[j] +
           gradient.cov_xy * (gx[i] * gy[j] + gx[j] * gy[i]) / 2;
  };
  const Eigen::Matrix<double, 6, 1> entries{
      {of(0, 0), of(1, 1), of(2, 2), 2 * of(1, 2), 2 * of(0, 2), 2 * of(0, 1)}};
  out.covariance = entries.cast<float>();
  return out;
}

ShapeGradient shape_gradient(const Eigen::Vector3f& scale,
                             const Eigen::Vector4f& rotation,
                             const CovarianceGradient& gradient) {
  const Eigen::Vector4d raw = rotation.cast<double>();
  const double length = raw.norm();
  const Eigen::Vector4d q = raw / length;
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  const Eigen::Vector3d s = scale.cast<double>();
  const Eigen::Matrix3d of_axes = 2 * as_matrix(gradient) * R * s.asDiagonal();  // of R S
  return {of_axes.cwiseProduct(R).colwise().sum().transpose(),
          of_unit_quaternion(q, of_axes * s.asDiagonal()) / length};
}

}  // namespace cgs
