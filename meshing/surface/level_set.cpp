// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <memory>

#include <openvdb/tools/LevelSetTracker.h>
#include <tbb/parallel_for.h>

#include "meshing/surface/solid.h"

namespace cgs {

namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr int kBlock = 8;
constexpr int kHalfWidth = 3;  // Voxels of the band on each side.

// Distances of a solid, block by block.
class Band {
 public:
  Band(const Solid& solid, const Volume& volume) : solid_(solid), voxel_(volume.voxel_size) {
    for (size_t k = 0; k < 3; ++k) {
      first_[int(k)] = (solid.origin[int(k)] & ~(kBlock - 1)) - kBlock;
      const int end = solid.origin[int(k)] + solid.size.at(k) + kBlock;
      blocks_[int(k)] = (end - first_[int(k)] + kBlock - 1) / kBlock;
    }
  }

  size_t count() const { return size_t(blocks_.x()) * size_t(blocks_.y()) * size_t(blocks_.z()); }
  Coord origin(size_t i) const {
    const auto ny = size_t(blocks_.y());
    const auto nz = size_t(blocks_.z());
    return first_.offsetBy(
        int(i / (ny * nz)) * kBlock, int(i / nz % ny) * kBlock, int(i % nz) * kBlock);
  }

  // The leaf of a block, or null if no voxel of it lies in the band.
  std::unique_ptr<Leaf> leaf(const Coord& at) const {
    constexpr int kSide = kBlock + 2 * kHalfWidth;
    std::array<uint8_t, size_t{kSide} * kSide * kSide> inside{};
    bool any = false;
    bool all = true;
    for (int n = 0; n < kSide * kSide * kSide; ++n) {
      const Coord local(n / (kSide * kSide), n / kSide % kSide, n % kSide);
      const bool in = is_inside(at + local.offsetBy(-kHalfWidth));
      inside.at(size_t(n)) = in;
      any |= in;
      all &= in;
    }
    if (!any || all) return nullptr;
    const auto same_around = [&](const Coord& voxel) {
      const auto side = [&](int x, int y, int z) {
        const Coord p = voxel.offsetBy(x, y, z);
        const int n = (p.x() * kSide + p.y()) * kSide + p.z();
        return inside.at(size_t(n));
      };
      const auto own = side(kHalfWidth, kHalfWidth, kHalfWidth);
      for (int x = 1; x < 2 * kHalfWidth; ++x) {
        for (int y = 1; y < 2 * kHalfWidth; ++y) {
          for (int z = 1; z < 2 * kHalfWidth; ++z) {
            if (side(x, y, z) != own) return false;
          }
        }
      }
      return true;
    };
    auto out = std::make_unique<Leaf>(at, background(), false);
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
      const Coord local = Leaf::offsetToLocalCoord(n);
      if (same_around(local)) {
        out->setValueOff(n, is_inside(at + local) ? -background() : background());
      } else {
        out->setValueOn(n, start_distance(at + local));
      }
    }
    return out;
  }

  bool is_inside(const Coord& at) const {
    size_t i = 0;
    return index(at, i) && solid_.inside[i] != 0;
  }

  // The observed distance of a voxel whose observed sign has survived.
  bool observed(const Coord& at, openvdb::FloatGrid::ConstAccessor& tsdf, float& distance) const {
    size_t i = 0;
    if (!index(at, i) || solid_.evidence[i] == 0) return false;
    distance = tsdf.getValue(at);
    if ((distance < 0) != (solid_.inside[i] != 0)) return false;
    return true;
  }

  float background() const { return static_cast<float>(kHalfWidth) * voxel_; }

 private:
  bool index(const Coord& at, size_t& i) const {
    const Coord p = at - solid_.origin;
    for (int k = 0; k < 3; ++k) {
      if (p[k] < 0 || p[k] >= solid_.size.at(size_t(k))) return false;
    }
    i = solid_.index(p.x(), p.y(), p.z());
    return true;
  }

  // Across a flat wall the blur falls linearly by 2/3 per voxel around its middle.
  float start_distance(const Coord& at) const {
    size_t i = 0;
    const bool known = index(at, i);
    const bool in = known && solid_.inside[i] != 0;
    const float blur = known ? 1 - 2 * static_cast<float>(solid_.blurred[i]) / 729.0f : 1;
    const float distance = 1.5f * voxel_ * blur;
    const float least = 0.25f * voxel_;
    return in ? std::min(distance, -least) : std::max(distance, least);
  }

  const Solid& solid_;
  float voxel_;
  Coord first_;
  Coord blocks_;
};

void restore_observed(openvdb::FloatGrid& grid, const Band& band, const Volume& volume) {
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
  leaves.foreach ([&](auto& leaf, size_t) {
    auto tsdf = volume.tsdf->getConstAccessor();
    for (auto it = leaf.beginValueOn(); it; ++it) {
      float distance = 0;
      if (!band.observed(it.getCoord(), tsdf, distance)) distance = *it;
      it.setValue(std::clamp(distance, -band.background(), band.background()));
    }
  });
}

// Solves for distance with upwind steps of first order: higher orders cost ten times as much and
// the observed part is put back afterwards anyway.
void redistance(openvdb::FloatGrid& grid) {
  openvdb::tools::LevelSetTracker<openvdb::FloatGrid> tracker(grid);
  tracker.setSpatialScheme(openvdb::math::FIRST_BIAS);
  tracker.setTemporalScheme(openvdb::math::TVD_RK1);
  constexpr int kSteps = 8;  // Each carries distance 0.3 voxels further.
  tracker.setNormCount(kSteps);
  tracker.normalize();
}

}  // namespace

openvdb::FloatGrid::Ptr level_set(const Solid& solid, const Volume& volume) {
  const Band band(solid, volume);
  openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(band.background());
  grid->setName("surface");
  grid->setTransform(volume.tsdf->transform().copy());
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  std::vector<std::unique_ptr<Leaf>> leaves(band.count());
  tbb::parallel_for(
      size_t(0), leaves.size(), [&](size_t i) { leaves[i] = band.leaf(band.origin(i)); });
  for (size_t i = 0; i < leaves.size(); ++i) {
    const Coord at = band.origin(i);
    if (leaves[i]) {
      grid->tree().addLeaf(leaves[i].release());
    } else if (band.is_inside(at)) {
      grid->tree().addTile(1, at, -band.background(), false);
    }
  }
  restore_observed(*grid, band, volume);
  redistance(*grid);
  restore_observed(*grid, band, volume);
  return grid;
}

}  // namespace cgs
