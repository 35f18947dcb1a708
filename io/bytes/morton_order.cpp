// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/morton_order.h"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>

namespace cgs {

namespace {

/// The lowest 21 bits, each third bit from now on.
uint64_t spread(uint64_t bits) {
  bits = (bits | bits << 32) & 0x001F00000000FFFF;
  bits = (bits | bits << 16) & 0x001F0000FF0000FF;
  bits = (bits | bits << 8) & 0x100F00F00F00F00F;
  bits = (bits | bits << 4) & 0x10C30C30C30C30C3;
  return (bits | bits << 2) & 0x1249249249249249;
}

}  // namespace

std::vector<uint32_t> morton_order(const std::vector<Eigen::Vector3f>& positions) {
  constexpr double kCells = (1 << 21) - 1;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : positions) box.extend(p.cast<double>());
  std::vector<std::pair<uint64_t, uint32_t>> keys;
  keys.reserve(positions.size());
  for (const Eigen::Vector3f& p : positions) {
    uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double size = box.max()[axis] - box.min()[axis];
      const double t = size > 0 ? (double{p[axis]} - box.min()[axis]) / size : 0;
      key |= spread(static_cast<uint64_t>(t * kCells)) << axis;
    }
    keys.emplace_back(key, static_cast<uint32_t>(keys.size()));
  }
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> out;
  out.reserve(keys.size());
  for (const auto& [key, index] : keys) out.push_back(index);
  return out;
}

}  // namespace cgs
