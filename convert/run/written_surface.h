// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Largest distances between a mesh as a file holds it and the surface it was made from, both ways
/// [internal units].
struct SurfaceDeviation {
  double evidence = 0;  ///< From places on faces with evidence; all without provenance.
  double inferred = 0;  ///< From places on Inferred and Estimated faces.
  size_t places = 0;    ///< Where it was measured: all corners, and as many places spread over the
                        ///< area as there are faces, 100,000 at least. Along the edges the
                        ///< farthest place is searched besides.

  double max() const { return evidence > inferred ? evidence : inferred; }
};

/// \pre both have faces and are in one frame
SurfaceDeviation surface_deviation(const TriangleMesh& written, const TriangleMesh& fused);

/// The surface of a volume.vdb that was fused, closed but not simplified: what the watertight mesh
/// of a run was made from.
/// \throws BadInput
TriangleMesh fused_surface(const std::filesystem::path& volume, size_t memory_limit);

/// The largest distance of a vertex from where it was, of files with the same vertices in the same
/// order (PLY, OBJ) or, for STL and 3MF as write_mesh_files() wrote them, of a corner of a face
/// [internal units]. What the mesh deviates by, the file deviates by this more at most.
/// \throws BadInput, also if the file has other numbers of vertices or faces
double vertex_moves(const std::filesystem::path& file,
                    const TriangleMesh& mesh,
                    const Frame& frame);

/// How much of the surface that photographs show is known to a length.
struct KnownArea {
  double seen = 0;    ///< Observed and SingleView faces [internal units squared].
  double within = 0;  ///< Of these, where no corner has a sigma above the length.

  double share() const { return seen > 0 ? within / seen : 0; }
};
KnownArea known_within(const TriangleMesh& mesh, double length);

}  // namespace cgs
