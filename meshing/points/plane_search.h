// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace cgs {

/// A plane through many points of a cloud.
struct FoundPlane {
  Eigen::Hyperplane<double, 3> plane;  ///< [internal units]
  std::vector<uint8_t> on_plane;       ///< Per point: 1 = within the distance.
  size_t count = 0;                    ///< Points on it.
  double rms = 0;                      ///< Of their distances [internal units].
};

/// The plane that has most points within a distance, of `tries` planes through three points each,
/// then fitted to all of its points. The same points give the same plane.
/// \param distance  [internal units], > 0
/// Source: Fischler and Bolles 1981, "Random sample consensus".
/// \throws InvalidInput unless distance > 0; NumericalError without three points off a line
FoundPlane largest_plane(const std::vector<Eigen::Vector3f>& points,
                         double distance,
                         size_t tries = 1000);

}  // namespace cgs
