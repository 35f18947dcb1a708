// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A point cloud whose points have moved.
struct SmoothedPoints {
  TriangleMesh cloud;
  size_t held = 0;  ///< Points around which no surface could be laid; they stayed.
  double rms = 0;   ///< Of the distances that the others moved [internal units].
  double most = 0;  ///< The longest of them.
};

/// Lays a curved surface (a polynomial of second degree) through each point's nearest ones and
/// moves it there.
///
/// Points that state a sigma look at such points alone, so that what nobody vouches for does not
/// drag what was measured. Support and colours stay with their points; sigma becomes the root of
/// sigma^2 + distance moved^2: a smoother cloud is not a better known one, and no longer where it
/// was measured. Normals, if any, become those of the curved surfaces, on the side of those before.
/// Source: Cazals and Pouget 2005, "Estimating differential quantities using polynomial fitting of
/// osculating jets", as in CGAL.
/// \param neighbors  the point included, >= 6
/// \throws InvalidInput for fewer neighbours, if there are faces, or fewer points than neighbours
SmoothedPoints smoothed_points(const TriangleMesh& cloud, size_t neighbors);

}  // namespace cgs
