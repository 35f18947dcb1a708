// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/measured_value.h"
#include "meshing/mesh/nearest_surface.h"

namespace cgs {

/// The shortest way over a surface.
struct SurfacePath {
  MeasuredValue length;                 ///< Its parts are the lengths over faces of each label.
  std::vector<Eigen::Vector3d> points;  ///< From end to end [internal units]; where it bends.
  bool exact = true;  ///< False: shortest within a band only, as the surface has too many faces;
                      ///< then `length` is an upper bound.
};

/// The shortest way along the surface between two points of it, through the inside of faces.
///
/// Exact on the whole surface: every shortest way lies within the ellipsoid that a way along edges
/// bounds, so that only its faces take part. Faces meet where their corners are in the same places;
/// where more than two share an edge the surface counts as cut there.
/// Source: Xin and Wang 2009, "Improving Chen and Han's algorithm on the discrete geodesic
/// problem", as in CGAL.
/// \throws InvalidInput if no way leads from one to the other
SurfacePath distance_along(const MeasurableMesh& mesh,
                           const SurfacePoint& from,
                           const SurfacePoint& to);

}  // namespace cgs
