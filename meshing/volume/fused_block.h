// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include <openvdb/openvdb.h>

#include "meshing/volume/block_evidence.h"
#include "meshing/volume/tsdf_report.h"
#include "meshing/volume/volume.h"

namespace cgs {

/// Voxels of a block by what they are.
struct BlockCounts {
  size_t free = 0, occupied = 0, estimated = 0, hidden = 0, unseen = 0, conflicts = 0, carved = 0;
};

/// One evaluated block: leaves where it is mixed, else only what it is.
struct FusedBlock {
  Sight whole = Sight::Mixed;
  std::unique_ptr<openvdb::FloatTree::LeafNodeType> tsdf, weight, support, sigma;
  std::unique_ptr<openvdb::Vec3STree::LeafNodeType> color;
  std::unique_ptr<openvdb::Int32Tree::LeafNodeType> state;
  BlockCounts counts;
};

/// What decides between evidence.
struct FusionRules {
  double voxel = 0;
  float min_weight = 0;
  double common_sigma = 0;
};

/// The leaves of a block, from all that is known about it.
FusedBlock fused_block(const BlockEvidence& evidence,
                       const openvdb::Coord& origin,
                       const FusionRules& rules);

Volume empty_volume(double voxel, const Eigen::AlignedBox3d& bounds, double truncation);

/// Moves the leaves of a block into a volume.
void insert(Volume& volume, const openvdb::Coord& origin, FusedBlock& block);

/// Adds a block to what is reported.
void count(TsdfReport& report, const FusedBlock& block);

/// Memory of a block with everything, and of one with its state alone [bytes].
inline constexpr size_t kLeafBytes = 4 * sizeof(openvdb::FloatTree::LeafNodeType) +
                                     sizeof(openvdb::Vec3STree::LeafNodeType) +
                                     sizeof(openvdb::Int32Tree::LeafNodeType) +
                                     kBlockVoxels * (5 * sizeof(float) + 3 * sizeof(float));
inline constexpr size_t kStateLeafBytes =
    sizeof(openvdb::Int32Tree::LeafNodeType) + kBlockVoxels * sizeof(int32_t);

}  // namespace cgs
