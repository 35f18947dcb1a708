// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Derivatives of a loss with respect to the entries of Gaussians of the same names. Arrays that
/// the rasterizer was not asked for are left empty.
struct GaussianGradients {
  std::vector<Eigen::Vector3f> position;
  std::vector<float> opacity;
  std::vector<float> radius;              ///< Balls: with respect to the common value of scale.
  std::vector<Eigen::Vector3f> scale;     ///< Ellipsoids; with respect to the values, not logs.
  std::vector<Eigen::Vector4f> rotation;  ///< Ellipsoids; orthogonal to the quaternion.
  std::vector<Eigen::Vector3f> sh;        ///< All sh_count() coefficients, if asked for.
};

}  // namespace cgs
