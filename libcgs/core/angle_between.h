// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace cgs {

/// The angle between two directions of any length, 0 to pi [rad]; exact also near both ends, where
/// the arc cosine of their product is not.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace cgs
