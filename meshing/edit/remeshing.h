// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The mesh with every triangle split into four at the middles of its edges, so many times.
///
/// The surface stays where it is; parts keep the label of their face, new vertices lie between the
/// ends of their edge, see append_blend().
/// \throws LimitError beyond 2^28 faces
TriangleMesh subdivided(const TriangleMesh& mesh, size_t times);

/// \throws LimitError if splitting each face into four, so many times, gives more than 2^28
void require_room_to_subdivide(const TriangleMesh& mesh, size_t times);

/// The mesh with triangles of about equal sides.
///
/// Borders between labels, open rims and edges that turn by more than 40 degrees stay where they
/// are within the edge length, so that every label keeps its place and no corner is cut off.
/// Vertices take what the nearest point of the input states, see append_blend(); normals are made
/// anew from the faces.
/// \param edge  length of the sides [internal units], > 0
/// Source: Botsch and Kobbelt 2004, "A remeshing approach to multiresolution modeling", as in CGAL.
/// \throws InvalidInput unless edge > 0; LimitError beyond 2^26 faces; NumericalError if the mesh
///         is not manifold or intersects itself, as the work might then not end
TriangleMesh remeshed(const TriangleMesh& mesh, double edge);

}  // namespace cgs
