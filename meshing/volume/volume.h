// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>

namespace cgs {

/// What the input views say about a voxel. The numbers are those in the `state` grid and in files.
///
/// A NeverSeen voxel is *active* in the state grid where it is hidden: inside the frustum of at
/// least one view and behind the surface there. It is inactive where no view says anything.
enum class VoxelState : int {
  NeverSeen = 0,  ///< Hidden behind a surface in every view that could see it, or in no frustum.
  Free = 1,       ///< In front of the surface: known to be empty.
  Occupied = 2,   ///< In the band around an observed surface.
  Estimated = 3,  ///< In the band around a surface that photographs show, but nothing measured.
};

/// A fused volume. All grids share one transform, world = voxel_size * index, in internal units;
/// values live on voxel centres.
struct Volume {
  openvdb::FloatGrid::Ptr tsdf;     ///< Signed distance [internal units], + in front of the
                                    ///< surface; active on observed voxels of the band only.
  openvdb::FloatGrid::Ptr weight;   ///< Sum of the weights of the views in the band.
  openvdb::Vec3SGrid::Ptr color;    ///< Linear light, RGB in [0, 1], as programs that draw volumes
                                    ///< take it; active where a view gave colour.
  openvdb::FloatGrid::Ptr support;  ///< Photographs in the band that look at it from one side, the
                                    ///< side with more of them; depth that rests on one alone
                                    ///< counts as one at most, estimated depth not at all.
  openvdb::FloatGrid::Ptr sigma;    ///< Standard deviation of tsdf [internal units]; active where
                                    ///< the views came with one, but not on estimated voxels.
  openvdb::Int32Grid::Ptr state;    ///< VoxelState, tiles where constant.
  openvdb::FloatGrid::Ptr surface;  ///< Closed level set [internal units], - inside; null until
                                    ///< watertight_surface() has made it.
  float voxel_size = 0;             ///< [internal units]
  Eigen::AlignedBox3d bounds;       ///< What was fused [internal units].
};

}  // namespace cgs
