// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"

namespace cgs::test {

/// One Gaussian in double, so that differences of nearby scenes keep their digits.
struct ReferenceGaussian {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();  ///< Any length > 0.
  double opacity = 0;
  std::vector<Eigen::Vector3d> sh;  ///< 1, 4, 9 or 16
};

std::vector<ReferenceGaussian> reference_gaussians(const Gaussians& gaussians);

/// Red, green, blue, alpha, sums of w z, w z^2 and w^2, row-major.
using ReferencePlanes = std::array<std::vector<double>, 7>;

/// Slow and obvious: every pixel visits every Gaussian, nearest first, with the textbook inverse of
/// the 2x2 covariance, all in double. For drawable Gaussians: nothing is checked.
ReferencePlanes draw_reference(const std::vector<ReferenceGaussian>& gaussians,
                               const Camera& camera,
                               const Eigen::Vector3d& background);

}  // namespace cgs::test
