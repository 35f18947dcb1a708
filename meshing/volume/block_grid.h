// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <openvdb/openvdb.h>

#include "meshing/volume/block_evidence.h"

namespace cgs {

/// The blocks of 8 x 8 x 8 voxels that cover a box, in x-major order, and cubes of 4 x 4 x 4 of
/// them.
struct BlockGrid {
  static constexpr int kCube = 4;
  static constexpr size_t kBlocksPerCube = size_t{kCube} * kCube * kCube;

  openvdb::Coord first;  // in blocks
  openvdb::Coord count;
  double voxel = 0;

  size_t size() const { return size_t(count.x()) * size_t(count.y()) * size_t(count.z()); }
  openvdb::Coord cubes() const {
    return {(count.x() + kCube - 1) / kCube,
            (count.y() + kCube - 1) / kCube,
            (count.z() + kCube - 1) / kCube};
  }
  size_t cube_count() const {
    return size_t(cubes().x()) * size_t(cubes().y()) * size_t(cubes().z());
  }
  static openvdb::Coord unravelled(size_t i, const openvdb::Coord& count) {
    const auto nz = size_t(count.z());
    const auto ny = size_t(count.y());
    return {int(i / (ny * nz)), int(i / nz % ny), int(i % nz)};
  }
  openvdb::Coord origin(size_t i) const {
    const openvdb::Coord at = unravelled(i, count);
    return {(first.x() + at.x()) * kBlockSide,
            (first.y() + at.y()) * kBlockSide,
            (first.z() + at.z()) * kBlockSide};
  }
  // The blocks of a cube, from low to below high.
  std::pair<openvdb::Coord, openvdb::Coord> cube(size_t c) const {
    const openvdb::Coord at = unravelled(c, cubes());
    const openvdb::Coord low(at.x() * kCube, at.y() * kCube, at.z() * kCube);
    return {low, openvdb::Coord::minComponent(low.offsetBy(kCube), count)};
  }
  // Calls visit(block, n) for the n-th block of a cube.
  template <typename Visit>
  void each_in_cube(size_t c, const Visit& visit) const {
    const auto [low, high] = cube(c);
    size_t n = 0;
    for (int x = low.x(); x < high.x(); ++x) {
      for (int y = low.y(); y < high.y(); ++y) {
        for (int z = low.z(); z < high.z(); ++z) {
          visit((size_t(x) * size_t(count.y()) + size_t(y)) * size_t(count.z()) + size_t(z), n++);
        }
      }
    }
  }
  Eigen::AlignedBox3f cube_box(size_t c) const {
    const auto [low, high] = cube(c);
    const auto corner = [&](const openvdb::Coord& block, int last) -> Eigen::Vector3f {
      const openvdb::Coord at = first + block;
      return (voxel * (Eigen::Vector3d(at.x(), at.y(), at.z()) * kBlockSide -
                       Eigen::Vector3d::Constant(last)))
          .cast<float>();
    };
    return {corner(low, 0), corner(high, 1)};
  }
  /// Boxes around the voxel centres of the blocks of a cube, in the order of each_in_cube().
  std::vector<EightBoxes> block_boxes(size_t c) const;
};

/// The blocks around a box [internal units].
/// \throws LimitError if they are too many or too far off
BlockGrid block_grid(const Eigen::AlignedBox3d& bounds, double voxel);

}  // namespace cgs
