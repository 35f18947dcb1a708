// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh that is manifold and whose faces agree on what is outside, and what had to be done.
struct RepairedMesh {
  TriangleMesh mesh;
  size_t merged_vertices = 0;  ///< That lay exactly where another one does.
  size_t other_colors = 0;     ///< Of these, whose colour was another one, and is lost.
  size_t unused_vertices = 0;  ///< That no face names, or none any more.
  size_t flat_faces = 0;       ///< Without area, collapsed or flipped away.
  size_t flat_left = 0;        ///< Without area, that could be neither collapsed nor flipped.
  size_t duplicate_faces = 0;  ///< With the corners of another one.
  size_t split_edges = 0;      ///< Places where a vertex lay on an open edge of another face.
  size_t turned_faces = 0;     ///< Whose corners now run the other way.
  size_t split_vertices = 0;   ///< Added where more than two faces met at an edge, or only corners
                               ///< of two sheets.
  size_t self_intersections = 0;  ///< Pairs of faces; these are left as they are. One more than
                                  ///< kMostSelfIntersections if there are more.
};

/// Makes a mesh out of any set of triangles.
///
/// Merged vertices take the largest sigma (NaN if one has none) and the smallest support of those
/// they were, the rest of the first. T-junctions are split, see without_t_junctions(). Of duplicate
/// faces the one with the strongest evidence is kept. Faces of a part turn with the majority of its
/// area or, if the whole is closed and free of self-intersection, so that it bounds a volume. Where
/// a face without area is flipped away beside an Inferred one, both become Inferred.
/// Source: CGAL, Polygon Mesh Processing.
/// \pre face indices are below mesh.vertices.size()
RepairedMesh repaired(const TriangleMesh& mesh);

/// How many vertices lie exactly where another one does, so that faces that touch do not hang
/// together: of a mesh whose program writes the corners of every face, or of every seam, anew.
size_t repeated_vertices(const TriangleMesh& mesh);

/// The mesh without the faces that cut others; the gaps are open.
TriangleMesh without_self_intersections(const TriangleMesh& mesh);

}  // namespace cgs
