// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace cgs {

/// Sets of numbers that are joined and never parted; each is known by its smallest member.
class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  uint32_t root(uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  /// \return false if the two were in one set before.
  bool join(uint32_t a, uint32_t b) {
    const uint32_t ra = root(a);
    const uint32_t rb = root(b);
    parent_[std::max(ra, rb)] = std::min(ra, rb);
    return ra != rb;
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace cgs
