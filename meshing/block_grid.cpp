// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/block_grid.h"

#include <algorithm>
#include <string>

#include "libcgs/core/error.h"

namespace cgs {

BlockGrid block_grid(const Eigen::AlignedBox3d& bounds, double voxel) {
  const Eigen::Vector3d low = (bounds.min() / (voxel * kBlockSide)).array().floor();
  const Eigen::Vector3d high = (bounds.max() / (voxel * kBlockSide)).array().floor();
  constexpr double kMaxIndex = 1 << 20;  // Far inside what OpenVDB and float coordinates bear.
  const double largest =
      std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) * kBlockSide;
  const double blocks = (high - low + Eigen::Vector3d::Ones()).prod();
  constexpr double kMaxBlocks = 1 << 28;
  if (!(largest < kMaxIndex) || !(blocks < kMaxBlocks)) {
    throw LimitError("voxel size " + std::to_string(voxel) + " is too small for the bounds");
  }
  const Eigen::Vector3i first = low.cast<int>();
  const Eigen::Vector3i count = (high - low).cast<int>() + Eigen::Vector3i::Ones();
  return {{first.x(), first.y(), first.z()}, {count.x(), count.y(), count.z()}, voxel};
}

}  // namespace cgs
