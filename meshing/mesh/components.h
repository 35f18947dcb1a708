// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The parts of a mesh that hang together over shared vertices.
struct MeshComponents {
  std::vector<uint32_t> of_face;  ///< Component of every face, numbered by their first face.
  std::vector<double> area;       ///< Per component [internal units squared].
  std::vector<double> volume;     ///< Per component, signed; meaningful where it is closed.
};

MeshComponents components(const TriangleMesh& mesh);

/// Marks the faces that share a vertex with one that is marked, too.
/// \param faces  a mark per face: 1 or 0
void grow_over_vertices(const TriangleMesh& mesh, std::vector<uint8_t>& faces);

/// The mesh with only the faces where `keep` is set; unused vertices go, all attributes stay.
///
/// \pre keep is as long as mesh.faces.
TriangleMesh with_faces(const TriangleMesh& mesh, const std::vector<uint8_t>& keep);

/// The mesh without the vertices that no face has; all attributes stay.
TriangleMesh without_unused_vertices(const TriangleMesh& mesh);

/// The mesh without the components whose area is below `relative_area` of the largest one's.
TriangleMesh without_small_components(const TriangleMesh& mesh, double relative_area);

}  // namespace cgs
