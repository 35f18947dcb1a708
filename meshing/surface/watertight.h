// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/certificate.h"

namespace cgs {

struct Volume;

/// How the observed surface is closed.
struct WatertightOptions {
  double min_part = 0.001;  ///< Parts of matter below this fraction of the largest part's volume
                            ///< are floaters and removed; so are cavities against the largest empty
                            ///< part; in [0, 1].
  int max_gap = 16;  ///< Holes rimmed by seen surface, of an area up to its square [voxels], are
                     ///< labelled Interpolated, larger ones Inferred; >= 0.
  size_t memory_limit = size_t(4) << 30;  ///< [bytes] to work in, beside the volume.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

struct WatertightResult {
  TriangleMesh mesh;  ///< All attributes; see Provenance.
  Certificate certificate;
  std::string method;          ///< "level set", "level set, locally smoothed" or
                               ///< "level set, marching tetrahedra".
  size_t voxels_smoothed = 0;  ///< Changed to end self-intersections.
};

/// Closes a fused volume and meshes it.
///
/// Matter is what lies behind observed surface: the negative side of the band, and every voxel that
/// is hidden in at least one view and free in none, up to the bounds. Free space and what no view
/// says anything about are empty. Where the surface was observed it is the zero crossing of
/// volume.tsdf; elsewhere it is invented, smooth, and labelled so. A few voxels away from what was
/// observed, faces are large where it is flat, see zero_surface().
///
/// volume.surface receives the closed level set. If the mesh of it intersects itself, the field is
/// averaged around these places and meshed again; what then remains is meshed by marching
/// tetrahedra, which cannot intersect.
/// \return an empty mesh, whose certificate does not pass, if the volume holds no surface.
/// \throws LimitError     if the dense work arrays would exceed options.memory_limit.
WatertightResult watertight_surface(Volume& volume,
                                    const WatertightOptions& options,
                                    const Progress& progress = {});

}  // namespace cgs
