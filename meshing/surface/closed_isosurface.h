// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include <openvdb/openvdb.h>

#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/certificate.h"

namespace cgs {

/// The zero surface of a closed level set.
struct ClosedIsosurface {
  TriangleMesh mesh;  ///< Vertices and faces only [internal units].
  Certificate certificate;
  std::string method;          ///< "level set", "level set, locally smoothed" or
                               ///< "level set, marching tetrahedra".
  size_t voxels_smoothed = 0;  ///< Changed to end self-intersections.
};

/// Meshes a level set that keeps one sign around its active voxels.
///
/// If the mesh intersects itself, these places are meshed finely; where they are already, the field
/// is averaged around them and meshed again; what then remains is meshed by marching tetrahedra,
/// which cannot intersect. Shells of a few voxels are left out.
/// \param surface  its active voxels may be smoothed
/// \param fine     as zero_surface() takes it; grows
ClosedIsosurface closed_isosurface(openvdb::FloatGrid& surface,
                                   openvdb::BoolTree::Ptr fine = nullptr);

}  // namespace cgs
