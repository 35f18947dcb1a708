// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/block_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "libcgs/core/error.h"

namespace cgs {

std::vector<EightBoxes> BlockGrid::block_boxes(size_t c) const {
  constexpr double kMiddle = 0.5 * (kBlockSide - 1);
  std::vector<EightBoxes> out;
  each_in_cube(c, [&](size_t i, size_t n) {
    const size_t lane = n % kLanes;
    if (lane == 0) {
      out.emplace_back();
      out.back().half.setConstant(static_cast<float>(kMiddle * voxel));
    }
    const openvdb::Coord low = origin(i);
    for (size_t k = lane; k < kLanes; ++k) {  // Lanes without a block are like the last one.
      out.back().x[k] = static_cast<float>(voxel * (low.x() + kMiddle));
      out.back().y[k] = static_cast<float>(voxel * (low.y() + kMiddle));
      out.back().z[k] = static_cast<float>(voxel * (low.z() + kMiddle));
    }
  });
  return out;
}

BlockGrid block_grid(const Eigen::AlignedBox3d& bounds, double voxel) {
  const Eigen::Vector3d low = (bounds.min() / (voxel * kBlockSide)).array().floor();
  const Eigen::Vector3d high = (bounds.max() / (voxel * kBlockSide)).array().floor();
  constexpr double kMaxIndex = 1 << 20;  // Far inside what OpenVDB and float coordinates bear.
  const double largest =
      std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) * kBlockSide;
  const double blocks = (high - low + Eigen::Vector3d::Ones()).prod();
  constexpr double kMaxBlocks = 1 << 28;
  if (!(largest < kMaxIndex) || !(blocks < kMaxBlocks)) {
    // In voxels, for nobody outside knows the unit of this one.
    const double along = (bounds.sizes() / voxel).maxCoeff();
    char text[200];  // NOLINT(modernize-avoid-c-arrays)
    std::snprintf(text,
                  sizeof(text),
                  "the voxels are too small: %.3g of them along the longest side, %.3g in all; "
                  "at most %.3g and %.3g can be made",
                  along,
                  std::min(blocks * double(kBlockVoxels), std::pow(along, 3)),
                  kMaxIndex,
                  kMaxBlocks * double(kBlockVoxels));
    throw LimitError(text);
  }
  const Eigen::Vector3i first = low.cast<int>();
  const Eigen::Vector3i count = (high - low).cast<int>() + Eigen::Vector3i::Ones();
  return {{first.x(), first.y(), first.z()}, {count.x(), count.y(), count.z()}, voxel};
}

}  // namespace cgs
