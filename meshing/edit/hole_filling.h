// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <limits>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh with some of its holes closed.
struct FilledMesh {
  TriangleMesh mesh;
  size_t filled = 0;     ///< Holes that were closed.
  size_t left_open = 0;  ///< Holes that were wider, or could not be triangulated.
  size_t long_rims = 0;  ///< Of these, with more edges than allowed.
  double area = 0;       ///< Of the new faces [internal units squared].
};

/// Closes holes by smooth patches with triangles as large as those around them.
///
/// What closes a hole is invented: its faces are Inferred, its vertices have support 0 and no
/// sigma, and take colour from the rim, the nearer the more. Faces and vertices that were there
/// come first and stay as they are; normals of new vertices come from the faces. A mesh that does
/// not state provenance states none afterwards either.
/// \param widest       largest diagonal of the box around a hole's rim [internal units]
/// \param longest_rim  in edges; the time of a hole may grow with the cube of them
/// \throws NumericalError if the mesh is not manifold
/// Source: Liepa 2003, "Filling holes in meshes", as in CGAL.
FilledMesh holes_filled(const TriangleMesh& mesh,
                        double widest,
                        const Progress& progress = {},
                        size_t longest_rim = std::numeric_limits<size_t>::max());

}  // namespace cgs
