// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/gaussians.h"

namespace cgs {

Eigen::Matrix3f rotation_matrix(const Eigen::Vector4f& rotation) {
  // Divided by its largest entry first: squaring 1e-23 or 1e20 would leave the float range.
  const float largest = rotation.cwiseAbs().maxCoeff();
  if (!(largest > 0)) return Eigen::Matrix3f::Identity();
  const Eigen::Vector4f q = (rotation / largest).normalized();
  return Eigen::Quaternionf(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

Eigen::Matrix3f covariance(const Eigen::Vector3f& scale, const Eigen::Vector4f& rotation) {
  const Eigen::Matrix3f M = rotation_matrix(rotation) * scale.asDiagonal();
  return M * M.transpose();  // Eq. 6 with M = R S
}

}  // namespace cgs
