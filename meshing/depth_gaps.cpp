// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "meshing/depth_field.h"

namespace cgs {

namespace {

constexpr std::array<std::array<int, 2>, 4> kNeighbours = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

// The pixels of the patch of NaN that holds (x, y), marked in `seen`; empty if the patch reaches
// the border of the image.
std::vector<size_t> patch_of(const DepthMap& depth, size_t start, Raster<uint8_t>& seen) {
  std::vector<size_t> patch = {start};
  seen.data[start] = 1;
  bool enclosed = true;
  for (size_t i = 0; i < patch.size(); ++i) {
    const int x = static_cast<int>(patch[i] % size_t(depth.width));
    const int y = static_cast<int>(patch[i] / size_t(depth.width));
    for (const auto& [dx, dy] : kNeighbours) {
      if (!depth.contains(x + dx, y + dy)) {
        enclosed = false;
        continue;
      }
      const size_t next = depth.index(x + dx, y + dy);
      if (seen.data[next] != 0 || std::isfinite(depth.data[next])) continue;
      seen.data[next] = 1;
      patch.push_back(next);
    }
  }
  if (!enclosed) patch.clear();
  return patch;
}

// Gauss-Seidel on the Laplace equation of inverse depth, with the rim as boundary.
void fill_membrane(DepthMap& depth, const std::vector<size_t>& patch) {
  const auto width = static_cast<size_t>(depth.width);
  float rim = 0;
  int count = 0;
  const std::array<std::ptrdiff_t, 4> steps = {
      1, -1, std::ptrdiff_t(width), -std::ptrdiff_t(width)};
  for (const size_t p : patch) {
    for (const auto step : steps) {
      const float d = depth.data[p + size_t(step)];
      if (!std::isfinite(d)) continue;
      rim += 1 / d;
      ++count;
    }
  }
  if (count == 0) return;
  for (const size_t p : patch) depth.data[p] = static_cast<float>(count) / rim;
  const int rounds = 4 + 2 * static_cast<int>(std::sqrt(double(patch.size())));
  for (int round = 0; round < rounds; ++round) {
    for (const size_t p : patch) {
      float sum = 0;
      for (const auto step : steps) sum += 1 / depth.data[p + size_t(step)];
      depth.data[p] = 4 / sum;
    }
  }
}

}  // namespace

DepthMap with_gaps_filled(const DepthMap& depth, int max_area) {
  DepthMap filled = depth;
  Raster<uint8_t> seen(depth.width, depth.height, 0);
  for (size_t p = 0; p < depth.data.size(); ++p) {
    if (seen.data[p] != 0 || std::isfinite(depth.data[p])) continue;
    const std::vector<size_t> patch = patch_of(depth, p, seen);
    if (!patch.empty() && patch.size() <= size_t(max_area)) fill_membrane(filled, patch);
  }
  return filled;
}

}  // namespace cgs
