// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/gaussian_gradients.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/render/projection.h"

namespace cgs {

/// Derivatives of a loss with respect to what project_gaussians() makes of one Gaussian.
struct SplatGradient {
  double u = 0;  ///< [1 / pixels]
  double v = 0;
  /// With respect to the entries of the image covariance; xy stands for both off-diagonal ones.
  double cov_xx = 0;
  double cov_xy = 0;
  double cov_yy = 0;
  double depth = 0;
};

/// With respect to a ball.
struct BallGradient {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< World axes.
  double radius = 0;
};

/// With respect to an ellipsoid.
struct EllipsoidGradient {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< World axes.
  CovarianceGradient covariance = CovarianceGradient::Zero();
};

/// With respect to scale and rotation, which make a covariance.
struct ShapeGradient {
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();     ///< Of the values, not of logs.
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();  ///< Orthogonal to the quaternion.
};

/// Chains through the projection of a Gaussian with three equal scales, in closed form: its image
/// covariance is (radius / z)^2 (fx^2 (1 + a^2), fx fy a b; fx fy a b, fy^2 (1 + b^2)) + dilation
/// with a = x/z, b = y/z.
///
/// \param splat  as project_gaussians() gives it for a drawn Gaussian of that radius
BallGradient ball_gradient(const ProjectionView& view,
                           const Splat& splat,
                           float radius,
                           const SplatGradient& gradient);

/// Chains through the projection of any Gaussian.
///
/// \param splat     as project_gaussians() gives it for a drawn Gaussian of that shape
EllipsoidGradient ellipsoid_gradient(const ProjectionView& view,
                                     const Splat& splat,
                                     const Eigen::Vector3f& scale,
                                     const Eigen::Vector4f& rotation,
                                     const SplatGradient& gradient);

/// Chains through C = R S S^T R^T.
/// \param rotation  quaternion (w, x, y, z) of any length but 0
ShapeGradient shape_gradient(const Eigen::Vector3f& scale,
                             const Eigen::Vector4f& rotation,
                             const CovarianceGradient& gradient);

}  // namespace cgs
