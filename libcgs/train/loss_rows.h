// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"

namespace cgs {

// How the losses of losses.h walk over rasters; included by their sources alone.

/// Calls body(y) for every row, in parallel.
template <typename Body>
void for_rows(int height, const Body& body) {
  constexpr int kRowsPerTask = 16;
  const tbb::blocked_range<int> all(0, height, kRowsPerTask);
  tbb::parallel_for(all, [&](const tbb::blocked_range<int>& band) {
    for (int y = band.begin(); y < band.end(); ++y) body(y);
  });
}

/// Sum over rows of what value(y) returns, added in their order: the same bits for any number of
/// threads.
template <typename Value>
auto sum_over_rows(int height, const Value& value) {
  using Sum = decltype(value(0));
  std::vector<Sum> sums(height);
  for_rows(height, [&](int y) { sums[y] = value(y); });
  Sum total = sums[0] - sums[0];
  for (const Sum& sum : sums) total += sum;
  return total;
}

/// Sum over i < count of what value(i) returns, each added once in a fixed order.
template <typename Value>
double sum_over_blocks(size_t count, const Value& value) {
  constexpr size_t kBlock = 4096;
  std::vector<double> sums((count + kBlock - 1) / kBlock, 0);
  tbb::parallel_for(size_t{0}, sums.size(), [&](size_t block) {
    const size_t end = std::min(count, (block + 1) * kBlock);
    for (size_t i = block * kBlock; i < end; ++i) sums[block] += value(i);
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

template <typename T>
bool same_size(const Raster<float>& a, const Raster<T>& b) {
  return a.width == b.width && a.height == b.height;
}

/// The gradient that a loss adds to: `raster`, created with zeros if it is empty.
inline Raster<float>& gradient_like(const Raster<float>& value, Raster<float>& raster) {
  if (raster.empty()) raster = Raster<float>(value.width, value.height, 0);
  require(
      same_size(value, raster), "losses: gradient must have the size of the view", raster.width);
  return raster;
}

/// Makes a gradient with respect to opacities one entry per Gaussian, zeros if it is empty.
inline void opacity_gradient_like(const Gaussians& gaussians, std::vector<float>& gradient) {
  if (gradient.empty()) gradient.assign(gaussians.size(), 0.0f);
  require(gradient.size() == gaussians.size(),
          "losses: gradient must have one entry per Gaussian",
          gradient.size());
}

/// \throws InvalidInput unless all planes and the mask have one size and are not empty
inline void check_sizes(const ColorPlanes& a, const ColorPlanes& b, const MaskMap* use) {
  for (int c = 0; c < 3; ++c) {
    const bool fits = !a[0].empty() && same_size(a[0], a[c]) && same_size(a[0], b[c]);
    require(fits, "losses: images must have one size and hold pixels", b[c].width);
  }
  const bool fits = use == nullptr || same_size(a[0], *use);
  require(fits, "losses: mask must have the size of the images", fits ? 0 : use->width);
}

}  // namespace cgs
