// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// Ground or a wall that was measured.
struct MeasuredPlane {
  Eigen::Hyperplane<double, 3> plane;  ///< [internal units]; the normal of ground points up.
  double lowest = 0;  ///< Of what was measured of a wall, the height along Frame::up [internal
                      ///< units]; minus infinity for ground.
};

/// The first of some planes on which a pixel lies at a z-depth [internal units]: within 2 % of the
/// depth along its ray, and half a percent across the plane.
/// \return its index; planes.size() where it lies on none
size_t plane_of(
    const std::vector<MeasuredPlane>& planes, const Camera& camera, int x, int y, double depth);

/// Level ground and upright walls that many measured pixels of all views lie on: one in 25 or more
/// of them. Whatever is large has slices that look like planes, so that more is asked for: hardly
/// anything lies just beside a plane, or most of it is turned like it, or a view sees a wall over a
/// wide range of depths. What has more below it than one pixel in 20 is no ground.
///
/// \param priors  of scene.input, in its order
/// \return about by size, the same for the same input; empty where Frame::up is not known
/// Source: Fischler and Bolles 1981, "Random sample consensus"; Furukawa et al. 2009,
///         "Manhattan-world stereo".
std::vector<MeasuredPlane> measured_planes(const Scene& scene,
                                           const std::vector<ViewPriors>& priors);

}  // namespace cgs
