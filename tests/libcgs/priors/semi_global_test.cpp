// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/semi_global.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::semi_global_test {
namespace {

// Path costs by the recurrence, one direction after the other, on a guide without edges.
Raster<int> best_planes_by_recurrence(const CostVolume& v, int P1, int P2) {
  std::vector<int> total(v.cost.size(), 0);
  const auto at = [&](int x, int y, int d) {
    return (static_cast<size_t>(y) * v.width + x) * v.planes + d;
  };
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      std::vector<int> path(v.cost.size());
      for (int j = 0; j < v.height; ++j) {
        const int y = dy < 0 ? v.height - 1 - j : j;
        for (int i = 0; i < v.width; ++i) {
          const int x = dx < 0 ? v.width - 1 - i : i;
          const int px = x - dx;
          const int py = y - dy;
          const bool first = px < 0 || py < 0 || px >= v.width || py >= v.height;
          for (int d = 0; d < v.planes; ++d) {
            int& cost = path[at(x, y, d)];
            cost = v.cost[at(x, y, d)];
            if (first) continue;
            int least = 1 << 20;
            int best = 1 << 20;
            for (int e = 0; e < v.planes; ++e) {
              const int before = path[at(px, py, e)];
              least = std::min(least, before);
              const int change = std::abs(e - d);
              best = std::min(best, before + (change == 0 ? 0 : change == 1 ? P1 : P2));
            }
            cost += best - least;
          }
        }
      }
      for (size_t k = 0; k < total.size(); ++k) total[k] += path[k];
    }
  }
  Raster<int> out(v.width, v.height, 0);
  for (int y = 0; y < v.height; ++y) {
    for (int x = 0; x < v.width; ++x) {
      const auto begin = total.begin() + static_cast<std::ptrdiff_t>(at(x, y, 0));
      out(x, y) = static_cast<int>(std::min_element(begin, begin + v.planes) - begin);
    }
  }
  return out;
}

TEST(SemiGlobalPlanes, EqualsTheRecurrence) {
  CostVolume volume{70, 9, 21, {}};
  volume.cost.resize(70 * 9 * 21);
  std::mt19937 random(3);
  for (uint8_t& c : volume.cost) c = static_cast<uint8_t>(random() % (kLargestCost + 1));
  const Raster<float> guide(70, 9, 100.0f);
  const Raster<float> planes = semi_global_planes(volume, guide, {});
  const SmoothnessPenalties penalties;
  const Raster<int> expected =
      best_planes_by_recurrence(volume, penalties.small_step, penalties.large_step);
  for (size_t i = 0; i < planes.data.size(); ++i) {
    ASSERT_LE(std::abs(planes.data[i] - static_cast<float>(expected.data[i])), 0.5f) << i;
  }
}

}  // namespace
}  // namespace cgs::semi_global_test
