// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "libcgs/core/gaussians.h"

namespace cgs::test {

/// A flat round splat on a surface: a tenth as thick as wide.
void add_disc(Gaussians& g,
              const Eigen::Vector3d& place,
              const Eigen::Vector3d& normal,
              double radius);

/// A sphere of evenly spread discs that overlap.
void add_sphere(Gaussians& g, const Eigen::Vector3d& center, double radius, int count);

/// A square of discs through `center`, `steps` along a side.
void add_sheet(Gaussians& g,
               const Eigen::Vector3d& center,
               const Eigen::Vector3d& u,
               const Eigen::Vector3d& v,
               int steps);

/// The six sides of a cube.
void add_cube(Gaussians& g, const Eigen::Vector3d& center, double half, int steps);

}  // namespace cgs::test
