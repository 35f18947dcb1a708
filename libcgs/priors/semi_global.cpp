// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/semi_global.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

// Large enough to lose every minimum, small enough that adding a penalty does not wrap.
constexpr int16_t kNever = 8000;
constexpr int kColumnGrain = 64;

// Path costs of one pixel with a sentinel on either side, and their minimum.
struct PathCosts {
  std::vector<int16_t> values;  // per pixel: planes + 2
  std::vector<int16_t> least;
  int planes;

  PathCosts(int pixels, int plane_count)
      : values(static_cast<size_t>(pixels) * (static_cast<size_t>(plane_count) + 2), kNever),
        least(static_cast<size_t>(pixels), 0),
        planes(plane_count) {}
  int16_t* at(int pixel) {
    return &values[static_cast<size_t>(pixel) * (static_cast<size_t>(planes) + 2) + 1];
  }
};

class Aggregation {
 public:
  Aggregation(const CostVolume& volume, const Raster<float>& guide, const SmoothnessPenalties& p)
      : volume_(volume), guide_(guide), penalties_(p), total_(volume.cost.size(), 0) {}

  void along_rows(const Progress& progress) {
    SharedProgress shared(progress, static_cast<size_t>(volume_.height));
    tbb::parallel_for(0, volume_.height, [&](int y) {
      PathCosts pair(2, volume_.planes);
      for (const int dx : {1, -1}) {
        const int begin = dx > 0 ? 0 : volume_.width - 1;
        for (int k = 0; k < volume_.width; ++k) {
          const int x = begin + dx * k;
          step({x, y}, {x - dx, y}, {pair, (k + 1) % 2}, {pair, k % 2});
        }
      }
      shared.advance();
    });
  }

  // Paths that come from the row above (dy = 1) or below (dy = -1): straight and both diagonals.
  void across_rows(int dy, const Progress& progress) {
    std::vector<PathCosts> before(3, PathCosts(volume_.width, volume_.planes));
    std::vector<PathCosts> here = before;
    const int begin = dy > 0 ? 0 : volume_.height - 1;
    for (int k = 0; k < volume_.height; ++k) {
      report(progress, double(k) / volume_.height);
      const int y = begin + dy * k;
      const tbb::blocked_range<int> columns(0, volume_.width, kColumnGrain);
      tbb::parallel_for(columns, [&](const tbb::blocked_range<int>& range) {
        for (int x = range.begin(); x != range.end(); ++x) {
          for (int dx = -1; dx <= 1; ++dx) {
            const auto path = static_cast<size_t>(dx) + 1;
            step({x, y}, {x - dx, y - dy}, {before[path], x - dx}, {here[path], x});
          }
        }
      });
      std::swap(before, here);
    }
  }

  Raster<float> winners() const {
    Raster<float> out(volume_.width, volume_.height, 0.0f);
    tbb::parallel_for(0, volume_.height, [&](int y) {
      for (int x = 0; x < volume_.width; ++x) {
        const uint16_t* s = &total_[offset(x, y)];
        const int best = static_cast<int>(std::min_element(s, s + volume_.planes) - s);
        float t = static_cast<float>(best);
        if (best > 0 && best + 1 < volume_.planes) {
          const float left = static_cast<float>(s[best - 1] - s[best]);
          const float right = static_cast<float>(s[best + 1] - s[best]);
          if (left + right > 0) t += 0.5f * (left - right) / (left + right);
        }
        out(x, y) = t;
      }
    });
    return out;
  }

 private:
  struct Pixel {
    int x, y;
  };
  struct Slot {
    PathCosts& costs;
    int pixel;
  };

  size_t offset(int x, int y) const {
    return guide_.index(x, y) * static_cast<size_t>(volume_.planes);
  }

  void step(Pixel p, Pixel previous, Slot from, Slot to) {
    const uint8_t* cost = volume_.at(p.x, p.y);
    uint16_t* total = &total_[offset(p.x, p.y)];
    int16_t* out = to.costs.at(to.pixel);
    const int planes = volume_.planes;
    int16_t least = kNever;
    if (!guide_.contains(previous.x, previous.y)) {
      for (int d = 0; d < planes; ++d) {
        out[d] = cost[d];
        least = std::min(least, out[d]);
        total[d] = static_cast<uint16_t>(total[d] + cost[d]);
      }
    } else {
      const int16_t* in = from.costs.at(from.pixel);
      const int16_t base = from.costs.least[static_cast<size_t>(from.pixel)];
      const float edge = std::abs(guide_(p.x, p.y) - guide_(previous.x, previous.y));
      const auto P1 = static_cast<int16_t>(penalties_.small_step);
      const auto P2 = static_cast<int16_t>(
          std::max(static_cast<float>(penalties_.small_step) + 1,
                   static_cast<float>(penalties_.large_step) / (1 + edge / penalties_.edge_level)));
      const auto jump = static_cast<int16_t>(base + P2);
      for (int d = 0; d < planes; ++d) {
        const auto neighbour = static_cast<int16_t>(std::min(in[d - 1], in[d + 1]) + P1);
        const int16_t best = std::min(std::min(in[d], neighbour), jump);
        out[d] = static_cast<int16_t>(cost[d] + best - base);
        least = std::min(least, out[d]);
        total[d] = static_cast<uint16_t>(total[d] + out[d]);
      }
    }
    to.costs.least[static_cast<size_t>(to.pixel)] = least;
  }

  const CostVolume& volume_;
  const Raster<float>& guide_;
  const SmoothnessPenalties& penalties_;
  std::vector<uint16_t> total_;
};

}  // namespace

Raster<float> semi_global_planes(const CostVolume& volume,
                                 const Raster<float>& guide,
                                 const SmoothnessPenalties& penalties,
                                 const Progress& progress) {
  Aggregation aggregation(volume, guide, penalties);
  aggregation.along_rows(part_of(progress, 0, 0.25));  // two of eight paths
  aggregation.across_rows(1, part_of(progress, 0.25, 0.625));
  aggregation.across_rows(-1, part_of(progress, 0.625, 1));
  return aggregation.winners();
}

}  // namespace cgs
