// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh whose rims were made to meet, and at how many vertices.
struct StitchedMesh {
  TriangleMesh mesh;
  size_t vertices = 0;
};

/// Splits faces on open rims at vertices of other rims that lie on the inside of their edge, as CAD
/// programs leave them where they cut two faces of a solid into triangles one by one (T-junctions).
///
/// A vertex counts as on an edge within 1e-5 of the diagonal of the mesh and a hundredth of the way
/// to the ends of the edge, and only where a rim goes on along the edge from there. Parts of a face
/// keep its label; no vertex is added or moved.
/// \return nothing if there are none; else with the number of vertices at which edges were split
/// \pre vertices are finite, and those at one place are one
std::optional<StitchedMesh> without_t_junctions(const TriangleMesh& mesh);

/// Joins vertices that lie exactly in one place along two rims that run side by side, as programs
/// double them where texture coordinates or normals change: the surface is the same without.
///
/// Rims stay apart where more than two meet in one place, or where their colours differ by more
/// than a tenth. Joined vertices take the largest sigma (NaN if one has none) and the smallest
/// support, the rest of the first.
/// \return nothing if there are none; else with the number of vertices that are gone
/// \pre vertices are finite
std::optional<StitchedMesh> with_joined_seams(const TriangleMesh& mesh);

}  // namespace cgs
