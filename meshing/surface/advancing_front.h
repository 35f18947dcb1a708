// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <limits>

#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/stated_surface.h"

namespace cgs {

/// A surface whose corners are points of a cloud.
struct InterpolatedSurface {
  TriangleMesh mesh;
  EvidenceTransfer evidence;
  size_t unused = 0;  ///< Points that are no corner of it.
};

/// Joins the points of a cloud to triangles, growing from the most plausible ones on; open where
/// there are no points.
///
/// All that is stated of a point stays as it is, for it does not move. A face takes the weakest
/// label under it (see take_labels()) and of its corners; what lies farther than two spacings from
/// every point bridges a gap and is Inferred. Faces look to the side of the normals, or, where
/// there are none or all are zero, away from the middle of their part; where that tells nothing, as
/// of a plane, to the larger side of the axis that they look along most.
/// Source: Cohen-Steiner and Da 2004, "A greedy Delaunay-based surface reconstruction algorithm",
/// as in CGAL.
/// \param max_edge  of a triangle [internal units], > 0
/// \throws InvalidInput if there are faces or fewer than 3 points, or for max_edge out of range;
///         NumericalError if no points can be joined
InterpolatedSurface advancing_front(const TriangleMesh& cloud,
                                    double max_edge = std::numeric_limits<double>::infinity());

}  // namespace cgs
