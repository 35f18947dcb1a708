// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/mesh_distance.h"

namespace cgs {

/// One way of closing a mesh, and what came of it.
struct ClosingAttempt {
  std::string way;     ///< "repair", "fill-holes", "cut-self-intersections", "level-set" or "wrap".
  double size = 0;     ///< Edge of a voxel, radius of the ball; 0 for other ways [internal units].
  std::string reason;  ///< Why it was not taken, or what speaks against it; empty = nothing.
};

/// A mesh that bounds a volume.
struct ClosedMesh {
  TriangleMesh mesh;
  Certificate certificate;               ///< Passes.
  std::vector<ClosingAttempt> attempts;  ///< In the order in which they were made.
  size_t taken = 0;                      ///< Which attempt the mesh is of.
  /// Within the filled surface, which the result was held against; NaN = it was not, or that is a
  /// sheet [internal units cubed].
  double compared_volume = std::numeric_limits<double>::quiet_NaN();
  double inside = 0;  ///< Share of the input that lies deep within the result: overlaps, and the
                      ///< walls of cavities that were filled.
  MeshDistance deviation;  ///< By samples: accuracy from the result to the input, completeness
                           ///< back.
};

/// Makes any mesh closed, 2-manifold, oriented outwards and free of self-intersection, by the
/// gentlest of these ways whose result passes its certificate:
///
/// 1. repair: repaired(), copies of a vertex where sheets only touch moved apart by a hundredth of
///    their edges, hanging sheets without volume dropped, shells settled, see settled_shells();
/// 2. fill-holes: that, and holes_filled();
/// 3. cut-self-intersections: of that, faces that cut others taken out with ever more of their
///    neighbours and the gaps filled, as long as little of the surface has to go;
/// 4. level-set: the outside of the surface with its holes filled, however it cuts itself;
/// 5. wrap: wrapped() with ever larger balls.
///
/// A certificate does not notice what is lost or bridged. So all are held against the input, which
/// must not stick out, and the last three against the volume that the outside of the filled surface
/// surrounds; what fails is taken only if nothing else is left, the nearest first, and its reason
/// stays. Level set and wrap fill cavities, see ClosedMesh::inside. Labels, sigma and support are
/// kept, see these functions: what closes a hole is Inferred.
///
/// \throws InvalidInput if the mesh has no face; NumericalError, with all reasons, if nothing
///         passes
ClosedMesh closed_mesh(const TriangleMesh& mesh, const Progress& progress = {});

}  // namespace cgs
