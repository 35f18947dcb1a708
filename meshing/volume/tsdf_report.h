// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include <Eigen/Geometry>

namespace cgs {

/// What came of fusing depth maps.
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

}  // namespace cgs
