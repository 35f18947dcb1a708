// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

namespace cgs {

/// How depth maps are fused into a truncated signed distance field (TSDF).
struct TsdfOptions {
  double voxel_size = 0;  ///< Voxel edge [internal units]; 0 = the median footprint of a pixel on
                          ///< the surface, coarsened until the bounds hold max_voxels.
  float truncation = 4;   ///< Half-width of the band around the surface [voxels]; >= 2. A pixel
                          ///< uses the larger of this and 3 sigma, at most 3 times this.
  int64_t max_voxels = 40'000'000;  ///< Voxels in the bounds when voxel_size is chosen; >= 4096
                                    ///< and then > (2 truncation + 4)^3, the band's at any size.
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

}  // namespace cgs
