// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace cgs {

/// Key that orders by depth, then by index.
///
/// \pre depth > 0: such floats sort like their bits.
inline uint64_t depth_key(float depth, uint32_t index) {
  return uint64_t{std::bit_cast<uint32_t>(depth)} << 32 | index;
}
inline uint32_t index_of_key(uint64_t key) { return static_cast<uint32_t>(key); }

/// Sorts depth keys in increasing order by radix.
///
/// \pre the indices of equal depths increase
/// \param scratch  overwritten; keeps its memory from one call to the next
void sort_depth_keys(std::vector<uint64_t>& keys, std::vector<uint64_t>& scratch);

}  // namespace cgs
