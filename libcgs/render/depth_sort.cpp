// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/depth_sort.h"

#include <algorithm>
#include <array>
#include <utility>

namespace cgs {

void sort_depth_keys(std::vector<uint64_t>& keys, std::vector<uint64_t>& scratch) {
  constexpr int kBits = 11;
  constexpr int kMaxPasses = 3;
  constexpr uint32_t kDigits = 1U << kBits;
  if (keys.size() < kDigits) {
    std::sort(keys.begin(), keys.end());
    return;
  }
  const auto depth_bits = [](uint64_t key) { return static_cast<uint32_t>(key >> 32); };
  uint32_t least = UINT32_MAX;
  uint32_t most = 0;
  for (const uint64_t key : keys) {
    least = std::min(least, depth_bits(key));
    most = std::max(most, depth_bits(key));
  }
  // Depths of one scene often share their leading bits: one pass less.
  const int passes = (std::bit_width(most - least) + kBits - 1) / kBits;
  std::array<std::array<uint32_t, kDigits>, kMaxPasses> starts{};
  for (const uint64_t key : keys) {
    const uint32_t value = depth_bits(key) - least;
    for (int pass = 0; pass < passes; ++pass)
      ++starts[pass][value >> (kBits * pass) & (kDigits - 1)];
  }
  scratch.resize(keys.size());
  for (int pass = 0; pass < passes; ++pass) {
    uint32_t begin = 0;
    for (uint32_t& start : starts[pass]) begin += std::exchange(start, begin);
    for (const uint64_t key : keys) {
      const uint32_t value = depth_bits(key) - least;
      scratch[starts[pass][value >> (kBits * pass) & (kDigits - 1)]++] = key;
    }
    keys.swap(scratch);
  }
}

}  // namespace cgs
