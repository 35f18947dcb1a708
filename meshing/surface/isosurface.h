// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/triangle_mesh.h"
#include "meshing/volume/volume.h"

namespace cgs {

/// The zero surface of a signed distance field as triangles, outward = towards positive values.
///
/// Dual contouring: one vertex per sheet and cell, so triangles are compact. Values nearer to zero
/// than 2 % of a voxel are moved to that distance (zero counts as outside): a surface exactly
/// through voxel centres would give triangles without area.
/// \param fine  voxels whose cells each have a vertex; in flat places elsewhere, blocks of up to
///              8 x 8 x 8 cells share one. Null = all.
/// \return vertices and faces only [internal units].
TriangleMesh zero_surface(const openvdb::FloatGrid& distance,
                          const openvdb::BoolTree::ConstPtr& fine = nullptr);

/// The same surface by marching tetrahedra (six to a cell, around its main diagonal).
///
/// More and thinner triangles than zero_surface(), but each lies in its own tetrahedron: it never
/// intersects itself. Closed wherever the field keeps one sign around its active voxels.
TriangleMesh zero_surface_by_tetrahedra(const openvdb::FloatGrid& distance);

struct OpenSurfaceOptions {
  double min_component = 0.001;  ///< Parts of less area than this fraction of the largest part are
                                 ///< floaters and left out; in [0, 1].

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// The observed surface of a fused volume, open where observation ends: every face lies in cells
/// whose eight voxels were observed.
///
/// \return a mesh with all attributes; provenance is Observed, SingleView, Estimated or Virtual.
///         Empty if there is no surface.
TriangleMesh open_surface(const Volume& volume, const OpenSurfaceOptions& options);

}  // namespace cgs
