// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace cgs {

/// The rotation that takes the direction `up` to +Z, as STL and 3MF readers expect.
///
/// The other two axes are chosen once and for all: target +X is the part of world +X across `up`
/// (of world +Y where `up` is within 26 degrees of the world X axis). up = +Z gives the identity.
/// \param up  any length but zero
/// \throws InvalidInput if `up` is zero or not finite.
Eigen::Matrix3d z_up_from(const Eigen::Vector3d& up);

/// The rotation that takes the direction `up` to +Y, as glTF demands; else as z_up_from().
Eigen::Matrix3d y_up_from(const Eigen::Vector3d& up);

}  // namespace cgs
