// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "meshing/measure/deviation.h"

namespace cgs {

/// How one surface was registered to another.
struct Registration {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< [internal units]
  double scale = 1;
  double rms_before = 0;  ///< Of the distances that take part [internal units].
  double rms_after = 0;
  double share = 0;  ///< Of the points that take part at the end.
  int iterations = 0;
  bool converged = false;  ///< False if it still moved at the end.

  Eigen::Vector3d apply(const Eigen::Vector3d& p) const {
    return scale * (rotation * p) + translation;
  }
};

/// Registers points to a surface, starting where they are (iterative closest points, point to
/// plane).
///
/// Robust: distances count by Tukey's weights, whose width follows the median of the distances, so
/// that what really changed pulls little. What has no counterpart within 4.7 times that width takes
/// no part, nor does surface that the mesh says nobody saw (unless that is all of it), nor points
/// to which the rim of an open mesh is nearest: the surface ends there, they lie where it goes on.
/// \throws InvalidInput for fewer than 100 points; NumericalError if fewer than 100 of them have a
///         counterpart, or if the surface does not hold them (a plane lets them slide)
/// Source: Chen and Medioni 1992, "Object modelling by registration of multiple range images".
Registration register_points(const std::vector<Eigen::Vector3d>& points,
                             const MeasurableMesh& mesh,
                             const NearestSurface& surface,
                             bool with_scale);

}  // namespace cgs
