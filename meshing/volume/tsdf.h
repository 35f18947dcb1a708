// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "libcgs/core/camera.h"
#include "libcgs/core/depth_evidence.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/raster.h"
#include "meshing/volume/volume.h"

namespace cgs {

/// One depth map to fuse. Rasters other than depth may be empty; all have the size of the camera.
struct TsdfView {
  Camera camera;     ///< [internal units]
  DepthMap depth;    ///< z-depth [internal units]; NaN = unknown, +infinity = known to hit nothing,
                     ///< such as the background of a cut-out object.
  DepthMap sigma;    ///< Standard deviation of depth [internal units]; empty or NaN = none
                     ///< known, the pixel then counts as exact.
  ColorImage color;  ///< Empty = no colour.
  Raster<uint8_t> usable;  ///< 0 where depth must be ignored; empty = use all.
  EvidenceMap evidence;    ///< What vouches for the depth. Adjoining depth of several views adds no
                           ///< more than one to the support, estimated depth nothing.
  bool is_virtual = false;  ///< Rendered from splats, not measured: adds to the surface but not to
                            ///< its support.
};

/// How depth maps are fused into a truncated signed distance field (TSDF).
struct TsdfOptions {
  double voxel_size = 0;  ///< Voxel edge [internal units]; 0 = the median footprint of a pixel on
                          ///< the surface, coarsened until the bounds hold max_voxels.
  float truncation = 4;   ///< Half-width of the band around the surface [voxels]; >= 2. A pixel
                          ///< uses the larger of this and 3 sigma, at most 3 times this.
  int64_t max_voxels = 40'000'000;  ///< Voxels in the bounds when voxel_size is chosen; >= 4096.
  double coarsest_voxel = 0;  ///< When voxel_size is chosen, max_voxels makes it no coarser than
                              ///< this or, where that is larger, the median pixel footprint or
                              ///< sigma [internal units]; 0 = any.
  float min_weight = 0;  ///< Band voxels below this weight count as not observed; >= 0. One exact
                         ///< view straight on gives 1, so a large value drops single views.
  double common_sigma = 0;  ///< Share of sigma by which all views are off alike, such as frames of
                            ///< one sensor: no number of them makes it smaller; in [0, 1].
  double depth_trunc = 0;   ///< Depth beyond this is ignored [internal units]; 0 = none is.
  int gap_pixels = 16;      ///< Enclosed patches of unknown depth up to this diameter [pixels] hide
                            ///< what is behind them as if they were surface; >= 0.
  size_t memory_limit = size_t(4) << 30;  ///< [bytes] for the result and all it takes to make it.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

struct TsdfReport {
  double voxel_size = 0;       ///< Used [internal units].
  Eigen::AlignedBox3d bounds;  ///< Fused [internal units].
  size_t voxels = 0;           ///< In the bounds, rounded up to blocks of 8 x 8 x 8.
  size_t free = 0;             ///< Voxels per state.
  size_t occupied = 0;
  size_t estimated = 0;
  size_t hidden = 0;           ///< Never seen, behind a surface.
  size_t unseen = 0;           ///< Never seen, nothing known.
  size_t conflicts = 0;        ///< Voxels near the surface of one view and free in another.
  size_t carved = 0;           ///< Conflicts that free space won.
  size_t predicted_bytes = 0;  ///< Upper bound, known before any grid was made.
  size_t portions = 1;         ///< In which the views were held.
  size_t actual_bytes = 0;     ///< Of the grids.
};

struct FusedVolume {
  Volume volume;
  TsdfReport report;
};

/// Depth maps that are made when they are asked for, as many as there may be.
struct TsdfSource {
  size_t count = 0;
  /// View i, without its colour where `with_color` is false. Asked for up to three times, from
  /// several threads at once; must give the same every time.
  std::function<TsdfView(size_t i, bool with_color)> view;
};

/// Fuses depth maps into a volume of three states.
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

inline constexpr size_t kViewMemory = size_t{256} << 20;
inline constexpr size_t kFootprints = size_t{1} << 22;
FusedVolume fuse_streamed(const TsdfSource& source,
                          const TsdfOptions& options,
                          const Progress& progress = {},
                          size_t view_memory = kViewMemory);

}  // namespace cgs
