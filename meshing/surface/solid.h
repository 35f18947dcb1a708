// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <openvdb/openvdb.h>

#include "meshing/volume/volume.h"

namespace cgs {

/// Dense voxels of a box, z fastest; the outermost layers are empty.
struct Solid {
  openvdb::Coord origin;                ///< Index of voxel (0, 0, 0) in the grids.
  std::array<int, 3> size = {0, 0, 0};  ///< In voxels.
  std::vector<uint8_t> inside;          ///< 1 = matter.
  std::vector<uint8_t> evidence;  ///< 1 = the sign was observed and must not be smoothed away.
  std::vector<int16_t> blurred;   ///< Matter in the neighbourhood, 0 … 729; see smooth().

  size_t index(int x, int y, int z) const {
    return (size_t(x) * size_t(size[1]) + size_t(y)) * size_t(size[2]) + size_t(z);
  }
};

/// Matter according to the states, inside the bounds of the volume: behind the observed
/// surface, and where hidden. Free and unknown voxels are empty.
Solid solid(const Volume& volume);

/// Gives voxels without evidence the sign of most of their 5 x 5 x 5 neighbourhood (weighted as two
/// 3 x 3 x 3 means in a row), which smooths what is invented and closes tunnels of single voxels.
/// Leaves that blur in `blurred`.
void smooth(Solid& solid);

struct SolidParts {
  size_t floaters = 0;  ///< Parts of matter removed.
  size_t cavities = 0;  ///< Enclosed empty parts filled.
};

/// Removes matter, and fills emptiness, in parts (6-connected) of fewer voxels than
/// `relative_size` of the largest part of their kind, and all matter that hangs together with
/// nothing observed. The outside is never filled.
SolidParts remove_small_parts(Solid& solid, double relative_size);

/// A narrow-band level set (3 voxels to both sides, - inside) of the solid.
///
/// Observed voxels keep their distance from volume.tsdf, so the observed surface does not move;
/// the others are re-distanced from the blur.
openvdb::FloatGrid::Ptr level_set(const Solid& solid, const Volume& volume);

}  // namespace cgs
