// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>

#include "libcgs/core/progress.h"
#include "meshing/volume/tsdf_options.h"
#include "meshing/volume/tsdf_report.h"
#include "meshing/volume/tsdf_view.h"
#include "meshing/volume/volume.h"

namespace cgs {

struct FusedVolume {
  Volume volume;
  TsdfReport report;
};

/// Fuses depth maps into a volume of four states (VoxelState).
///
/// - Bounds: the box of all surface points whose depth lies within the 1st and 99th percentile of
///   their view, plus truncation and two voxels.
/// - Distance of a voxel in a view: depth difference along z times the cosine factor of the local
///   plane, so that it is a distance to the surface, not along the ray. Depth is interpolated in
///   1/z (exact on planes), never across an occlusion edge; pixels that hang between two surfaces
///   are ignored.
/// - Weight: squared cosine of incidence / (1 + (sigma / voxel)^2), falling off behind the surface,
///   where the band is an assumption and not a measurement, and a quarter at occlusion edges. What
///   a view assumes more than two voxels and 3 sigma behind its surface counts only where no view
///   has the voxel in front of or nearer behind its own: plates and edges would grow.
/// - Free: farther than max(truncation, 3 sigma) in front of the surface. Where one view says free
///   and others a voxel behind their surface, the larger weight wins; a tie keeps it.
///
/// The result is bit-identical for any number of threads.
///
/// Of a source, only as many views are held at once as fit into `view_memory` and into a quarter of
/// options.memory_limit; beyond these, what has been summed up so far near the surface is kept
/// instead. The result is that of all at once; a voxel size that is chosen is the median of at most
/// kFootprints pixels, evenly spaced.
///
/// \throws InvalidInput   if there is no view, a raster does not match its camera, or no pixel has
///                        a depth.
/// \throws LimitError     if the predicted memory is above options.memory_limit.
/// Source: Curless and Levoy 1996, "A volumetric method for building complex models from range
///         images"; the fall-off behind the surface follows Newcombe et al. 2011 in spirit.
FusedVolume fuse(std::span<const TsdfView> views,
                 const TsdfOptions& options,
                 const Progress& progress = {});

/// Asks whether fuse() may take depth maps of so many pixels in all, before they are made.
/// \throws LimitError if they alone need more than the limit [bytes], whatever the voxels
void check_view_memory(size_t pixels, size_t limit);

inline constexpr size_t kViewMemory = size_t{256} << 20;
inline constexpr size_t kFootprints = size_t{1} << 22;
FusedVolume fuse_streamed(const TsdfSource& source,
                          const TsdfOptions& options,
                          const Progress& progress = {},
                          size_t view_memory = kViewMemory);

}  // namespace cgs
