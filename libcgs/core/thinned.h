// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace cgs {

/// Evenly out of many, `most` at most and in their order: for a bounded time and memory.
/// \pre most > 0
template <typename T>
std::vector<T> thinned(const std::vector<T>& all, size_t most) {
  const size_t step = (all.size() + most - 1) / most;
  if (step <= 1) return all;
  std::vector<T> out;
  for (size_t i = 0; i < all.size(); i += step) out.push_back(all[i]);
  return out;
}

}  // namespace cgs
