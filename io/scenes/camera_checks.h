// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <functional>
#include <string>

#include <Eigen/Geometry>

#include "io/bytes/byte_reader.h"
#include "libcgs/core/camera.h"

namespace cgs {

/// Throws the BadInput of a reader, which knows the file and the place in it.
using Refuse = std::function<void(Defect defect, const std::string& reason)>;

/// A pose from a rotation matrix and a translation as a file states them.
///
/// Deviations from a rotation up to 1e-3 are rounding: the nearest rotation is taken.
/// Calls refuse(Value) for values that are not finite, matrices further from orthonormal, and
/// reflections.
Eigen::Isometry3d checked_pose(const Eigen::Matrix3d& rotation,
                               const Eigen::Vector3d& translation,
                               const Refuse& refuse);

/// Calls refuse(Value) unless sizes and focal lengths are positive, everything is finite and the
/// principal point lies within ten image sizes of the image, which has at most max_pixels.
void check_intrinsics(const Camera& camera, const Refuse& refuse, const ReadLimits& limits = {});

/// Sets focal lengths and principal point from fx 0 cx / 0 fy cy / 0 0 1; the size is that of the
/// camera already. Calls refuse(Unsupported) for a matrix of another form, and as
/// check_intrinsics().
void set_intrinsics(Camera& camera, const Eigen::Matrix3d& K, const Refuse& refuse);

/// The undistorted radius up to which the distorted radius grows with it (both in units of the
/// focal length); infinity if it grows for ever.
///
/// \param distortion  k1 k2 p1 p2 k3
double fold_radius(const std::array<double, 5>& distortion);

/// The same of a lens that is r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8), r in any unit.
double fold_radius(const std::array<double, 4>& radial);

/// Calls refuse(Value) unless a coefficient is finite and so small that its powers are.
void check_coefficient(double value, const Refuse& refuse);

/// Calls refuse(Value) as check_coefficient(), or if the distortion cannot be undone
/// already inside the largest circle around the principal point that the image holds.
void check_distortion(const Camera& camera,
                      const std::array<double, 5>& distortion,
                      const Refuse& refuse);

}  // namespace cgs
