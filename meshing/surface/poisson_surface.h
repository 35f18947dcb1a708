// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/stated_surface.h"

namespace cgs {

struct PoissonOptions {
  double spacing = 0;  ///< Sides of triangles, about [internal units]; 0 = that of the points,
                       ///< coarser beyond 200,000 of them or 2 million triangles.

  /// \throws InvalidInput naming the field out of range
  void validate() const;
};

/// A closed surface through the middle of noisy points.
struct PoissonSurface {
  TriangleMesh mesh;
  EvidenceTransfer evidence;
  double spacing = 0;  ///< As used [internal units].
};

/// The surface whose inside has normals like those of a point cloud: closed and 2-manifold.
///
/// Points are thinned to the spacing first (see down_sampled()), so that the work depends on the
/// spacing and not on how often a place was measured; those without normal are left out. The result
/// takes label and sigma from all points, see take_evidence(): what lies farther than two of
/// *their* spacings from every point bridges a gap and is Inferred. Where sheets run on for want of
/// anything to close them, they end at a box around the points, which becomes a part of the
/// surface. Source: see PoissonFunction; its zero surface is taken on a grid of the spacing.
/// \throws InvalidInput if there are faces, no normals, or fewer than 10 points with one;
///         LimitError for more than 2 million points after thinning or 20 million triangles, or
///         if spacing is 0 and gaps are so wide that triangles would be 3 times as coarse for
///         them; NumericalError if fewer than 10 are left of them, or if they enclose nothing
PoissonSurface poisson_surface(const TriangleMesh& cloud,
                               const PoissonOptions& options,
                               const Progress& progress = {});

}  // namespace cgs
