// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/stated_surface.h"

namespace cgs {

struct WrapOptions {
  double alpha = 0;   ///< Radius of the ball that must not get in anywhere [internal units].
  double offset = 0;  ///< Distance at which the wrap is made [internal units].

  /// \throws InvalidInput naming the first field out of range
  void validate() const;
};

/// A closed surface around a mesh or point cloud.
struct WrappedMesh {
  TriangleMesh mesh;
  EvidenceTransfer evidence;
  bool knows_sides = true;        ///< Else nobody can tell whether the wrap went inside.
  double moved = 0;               ///< Share of the offset that was taken back, mean over vertices.
  double volume = 0;              ///< [internal units cubed]
  double input_volume = 0;        ///< Of the input, each hole closed by triangles to the middle of
                                  ///< its rim; NaN for a cloud, or where faces disagree on what is
                                  ///< outside. Far from volume, the wrap went in somewhere.
  size_t self_intersections = 0;  ///< Pairs of faces, from rounding alone; nearly always 0.
};

/// Wraps a ball of radius alpha around whatever is there, however broken: the result is closed,
/// 2-manifold and, but for rounding, free of self-intersection.
///
/// It is made at the offset outside the input. That bias is taken back: vertices move to the
/// nearest place of the input and then out again by what the faces between them cut off, so that
/// faces lie about the input and not within it. Where faces would cut each other, as at thin walls
/// and sharp edges, vertices move less.
///
/// Faces within two offsets of the input (of a cloud: or two spacings of its points) take its
/// labels, see take_evidence(); others bridge what nobody saw. A hole wider than the ball lets the
/// wrap in: what it covers there is the back of the input, which evidence.behind tells.
/// Source: Portaneri et al. 2022, "Alpha wrapping with an offset", as in CGAL.
/// \throws InvalidInput for options out of range; LimitError if alpha is so small that the work
///         would not end; NumericalError if nothing can be wrapped
WrappedMesh wrapped(const TriangleMesh& mesh,
                    const WrapOptions& options,
                    const Progress& progress = {});

}  // namespace cgs
