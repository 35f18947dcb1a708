// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Derivative of a loss with respect to the entries xx, yy, zz, yz, xz, xy of a covariance in world
/// axes; the last three stand for both off-diagonal entries.
using CovarianceGradient = Eigen::Matrix<float, 6, 1>;

/// G with dL = trace(G dC) for the covariance C.
inline Eigen::Matrix3d as_matrix(const CovarianceGradient& g) {
  const Eigen::Matrix<double, 6, 1> d = g.cast<double>();
  Eigen::Matrix3d out;
  out << d[0], d[5] / 2, d[4] / 2, d[5] / 2, d[1], d[3] / 2, d[4] / 2, d[3] / 2, d[2];
  return out;
}

/// Derivatives of a loss with respect to the entries of Gaussians of the same names. Arrays that
/// the rasterizer was not asked for are left empty.
struct GaussianGradients {
  std::vector<Eigen::Vector3f> position;
  std::vector<float> opacity;
  std::vector<float> radius;  ///< Balls: with respect to the common value of scale.
  std::vector<CovarianceGradient> covariance;  ///< Ellipsoids; shape_gradient() goes on from here.
  std::vector<Eigen::Vector3f> sh;             ///< All sh_count() coefficients, if asked for.
  std::vector<Eigen::Vector2f> image_place;    ///< Place of the centre in the image, if asked for
                                               ///< [1 / pixels].
};

/// Sets all derivatives to zero and keeps their memory, for the next sum over the same Gaussians.
inline void set_zero(GaussianGradients& g) {
  const Eigen::Vector3f none = Eigen::Vector3f::Zero();
  std::fill(g.position.begin(), g.position.end(), none);
  std::fill(g.opacity.begin(), g.opacity.end(), 0.0f);
  std::fill(g.radius.begin(), g.radius.end(), 0.0f);
  std::fill(
      g.covariance.begin(), g.covariance.end(), CovarianceGradient(CovarianceGradient::Zero()));
  std::fill(g.sh.begin(), g.sh.end(), none);
  std::fill(g.image_place.begin(), g.image_place.end(), Eigen::Vector2f(0, 0));
}

}  // namespace cgs
