// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/fused_block.h"

#include <cmath>
#include <string>
#include <type_traits>
#include <utility>

#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

using openvdb::Coord;
using StateLeaf = openvdb::Int32Tree::LeafNodeType;

void store_band(FusedBlock& block,
                openvdb::Index n,
                const Coord& origin,
                const BlockEvidence::Voxel& e,
                double common_sigma) {
  const auto leaf = [&](auto& pointer) -> auto& {
    using Leaf = std::remove_reference_t<decltype(*pointer)>;
    if (!pointer) pointer = std::make_unique<Leaf>(origin, typename Leaf::ValueType(0), false);
    return *pointer;
  };
  leaf(block.tsdf).setValueOn(n, static_cast<float>(e.mean()));
  leaf(block.weight).setValueOn(n, static_cast<float>(e.weight));
  leaf(block.support).setValueOn(n, e.support());
  if (e.has_sigma && !e.is_estimate())
    leaf(block.sigma).setValueOn(n, static_cast<float>(e.sigma(common_sigma)));
  if (e.color_weight <= 0) return;
  const Eigen::Vector3f coded = (e.color / e.color_weight).cast<float>();
  const Eigen::Vector3f c = coded.unaryExpr(&linear_from_srgb);
  leaf(block.color).setValueOn(n, openvdb::Vec3f(c.x(), c.y(), c.z()));
}

void store(FusedBlock& block,
           openvdb::Index n,
           const Coord& origin,
           const BlockEvidence::Voxel& e,
           const FusionRules& rules) {
  BlockCounts& counts = block.counts;
  const bool seen = e.weight > 0 && e.weight >= double(rules.min_weight);
  const bool conflict = seen && e.free_weight > 0 && std::abs(e.mean()) < rules.voxel;
  // In front of the surface both say the same.
  const bool carved = seen && e.distance < 0 && double(e.free_weight) > e.weight;
  counts.conflicts += conflict;
  counts.carved += conflict && carved;
  if (seen && !carved) {
    ++(e.is_estimate() ? counts.estimated : counts.occupied);
    const VoxelState state = e.is_estimate() ? VoxelState::Estimated : VoxelState::Occupied;
    block.state->setValueOn(n, int(state));
    store_band(block, n, origin, e, rules.common_sigma);
  } else if (e.free) {
    ++counts.free;
    block.state->setValueOn(n, int(VoxelState::Free));
  } else if (e.hidden || (e.weight > 0 && e.distance < 0)) {
    ++counts.hidden;
    block.state->setValueOn(n, int(VoxelState::NeverSeen));
  } else {
    ++counts.unseen;
  }
}

template <typename Grid>
typename Grid::Ptr empty_grid(const std::string& name,
                              const typename Grid::ValueType& background,
                              double voxel) {
  auto grid = Grid::create(background);
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  return grid;
}

}  // namespace

FusedBlock fused_block(const BlockEvidence& evidence,
                       const Coord& origin,
                       const FusionRules& rules) {
  FusedBlock block;
  block.state = std::make_unique<StateLeaf>(origin, 0, false);
  for (int n = 0; n < kBlockVoxels; ++n) {
    store(block, openvdb::Index(n), origin, evidence[size_t(n)], rules);
  }
  for (const auto& [count, sight] : {std::pair(block.counts.free, Sight::Free),
                                     std::pair(block.counts.hidden, Sight::Hidden),
                                     std::pair(block.counts.unseen, Sight::Nothing)}) {
    if (count == kBlockVoxels) block.whole = sight;
  }
  if (block.whole != Sight::Mixed) block.state.reset();
  return block;
}

Volume empty_volume(double voxel, const Eigen::AlignedBox3d& bounds, double truncation) {
  Volume volume;
  volume.voxel_size = static_cast<float>(voxel);
  volume.bounds = bounds;
  volume.tsdf =
      empty_grid<openvdb::FloatGrid>("tsdf", static_cast<float>(truncation * voxel), voxel);
  volume.weight = empty_grid<openvdb::FloatGrid>("weight", 0, voxel);
  volume.color = empty_grid<openvdb::Vec3SGrid>("color", openvdb::Vec3f(0), voxel);
  volume.support = empty_grid<openvdb::FloatGrid>("support", 0, voxel);
  volume.sigma = empty_grid<openvdb::FloatGrid>("sigma", 0, voxel);
  volume.state = empty_grid<openvdb::Int32Grid>("state", int(VoxelState::NeverSeen), voxel);
  return volume;
}

void insert(Volume& volume, const Coord& origin, FusedBlock& block) {
  constexpr openvdb::Index kTileLevel = 1;  // A tile of the size of a leaf.
  if (block.whole == Sight::Free) {
    volume.state->tree().addTile(kTileLevel, origin, int(VoxelState::Free), true);
  } else if (block.whole == Sight::Hidden) {
    volume.state->tree().addTile(kTileLevel, origin, int(VoxelState::NeverSeen), true);
  }
  const auto add = [](auto& grid, auto& leaf) {
    if (leaf) grid->tree().addLeaf(leaf.release());
  };
  add(volume.tsdf, block.tsdf);
  add(volume.weight, block.weight);
  add(volume.color, block.color);
  add(volume.support, block.support);
  add(volume.sigma, block.sigma);
  add(volume.state, block.state);
}

void count(TsdfReport& report, const FusedBlock& block) {
  report.free += block.counts.free +
                 (block.counts.free == 0 && block.whole == Sight::Free ? size_t(kBlockVoxels) : 0);
  report.hidden +=
      block.counts.hidden +
      (block.counts.hidden == 0 && block.whole == Sight::Hidden ? size_t(kBlockVoxels) : 0);
  report.occupied += block.counts.occupied;
  report.estimated += block.counts.estimated;
  report.conflicts += block.counts.conflicts;
  report.carved += block.counts.carved;
}

}  // namespace cgs
