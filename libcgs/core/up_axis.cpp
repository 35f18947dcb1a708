// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/up_axis.h"

#include <cmath>

#include <Eigen/Geometry>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

Eigen::Vector3d unit_up(const Eigen::Vector3d& up) {
  Eigen::Vector3d unit = up.stableNormalized();
  require(up.allFinite() && unit.norm() > 0.5,
          "up must be a finite vector other than zero",
          up.transpose());
  return unit;
}

/// Unit vector across `up` that stands for target +X.
Eigen::Vector3d across(const Eigen::Vector3d& up) {
  constexpr double kNearlyParallel = 0.9;
  const Eigen::Vector3d guide =
      std::abs(up.x()) > kNearlyParallel ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  return (guide - guide.dot(up) * up).normalized();
}

}  // namespace

Eigen::Matrix3d z_up_from(const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = unit_up(up);
  const Eigen::Vector3d x = across(z);
  Eigen::Matrix3d R;
  R << x.transpose(), z.cross(x).transpose(), z.transpose();
  return R;
}

Eigen::Matrix3d y_up_from(const Eigen::Vector3d& up) {
  const Eigen::Vector3d y = unit_up(up);
  const Eigen::Vector3d x = across(y);
  Eigen::Matrix3d R;
  R << x.transpose(), y.transpose(), x.cross(y).transpose();
  return R;
}

}  // namespace cgs
