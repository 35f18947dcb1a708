// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

#include "libcgs/core/split_mix.h"

namespace cgs {

/// A point moved by up to `most` along each axis [internal units], at random by its number.
///
/// For CGAL's Delaunay methods: among equally good choices, as on grids, they take the one whose
/// address in memory comes first; after this no two are equal, and the result is always the same.
inline Eigen::Vector3d nudged_point(const Eigen::Vector3f& point, uint64_t number, double most) {
  const auto random = [&](uint64_t axis) {  // in [-1, 1)
    return std::ldexp(static_cast<double>(random_number(3 * number + axis) >> 11), -52) - 1;
  };
  return point.cast<double>() + most * Eigen::Vector3d(random(0), random(1), random(2));
}

}  // namespace cgs
