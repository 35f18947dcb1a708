// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/pull_push.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace cgs {

namespace {

/// A weighted mean. In narrow gaps it leans to what is far: at half the depth a colour counts a
/// 256th. Wide ones are no gaps behind an edge.
class FarMean {
 public:
  explicit FarMean(bool is_narrow) : is_narrow_(is_narrow) {}

  void add(const PulledLevel& level, int x, int y, float share) {
    const float weight = share * level.weight(x, y);
    if (!(weight > 0)) return;
    const float depth = level.depth(x, y);
    if (depth > farthest_) {
      const float nearer = far_share(farthest_ / depth);
      color_ *= nearer;
      depth_ *= nearer;
      sum_ *= nearer;
      farthest_ = depth;
    }
    const float counts = weight * far_share(depth / farthest_);
    color_ += counts * level.color(x, y);
    depth_ += counts * depth;
    sum_ += counts;
    weight_ += weight;
  }
  bool has_any() const { return sum_ > 0; }
  Eigen::Vector3f color() const { return color_ / sum_; }
  float depth() const { return depth_ / sum_; }
  float weight() const { return weight_; }

 private:
  float far_share(float ratio) const {
    if (!is_narrow_) return 1;
    const float squared = ratio * ratio;
    return squared * squared * squared * squared;
  }

  bool is_narrow_;
  Eigen::Vector3f color_ = Eigen::Vector3f::Zero();
  float depth_ = 0;
  float sum_ = 0;
  float weight_ = 0;
  float farthest_ = 0;
};

// Half the size: what four pixels know together.
PulledLevel pulled(const PulledLevel& fine, bool is_narrow) {
  PulledLevel out((fine.color.width + 1) / 2, (fine.color.height + 1) / 2);
  for (int y = 0; y < out.color.height; ++y) {
    for (int x = 0; x < out.color.width; ++x) {
      FarMean mean(is_narrow);
      for (int k = 0; k < 4; ++k) {
        const int u = 2 * x + k % 2;
        const int v = 2 * y + k / 2;
        if (fine.color.contains(u, v)) mean.add(fine, u, v, 1);
      }
      if (!mean.has_any()) continue;
      out.color(x, y) = mean.color();
      out.depth(x, y) = mean.depth();
      out.weight(x, y) = std::min(1.0f, mean.weight());
    }
  }
  return out;
}

// Completes a level with what the next coarser one, itself complete, has at the same place.
void push(const PulledLevel& coarse, bool is_narrow, PulledLevel& fine) {
  for (int y = 0; y < fine.color.height; ++y) {
    for (int x = 0; x < fine.color.width; ++x) {
      const float known = fine.weight(x, y);
      if (known >= 1) continue;
      FarMean around(is_narrow);
      for (int k = 0; k < 4; ++k) {  // bilinear: 3/4 of the pixel it lies in, 1/4 of the next one
        const bool is_next_x = k % 2 == 1;
        const bool is_next_y = k / 2 == 1;
        const int u = x / 2 + (is_next_x ? 2 * (x % 2) - 1 : 0);
        const int v = y / 2 + (is_next_y ? 2 * (y % 2) - 1 : 0);
        const float share = (is_next_x ? 0.25f : 0.75f) * (is_next_y ? 0.25f : 0.75f);
        if (coarse.color.contains(u, v)) around.add(coarse, u, v, share);
      }
      if (!around.has_any()) continue;
      fine.color(x, y) = known * fine.color(x, y) + (1 - known) * around.color();
      fine.depth(x, y) = known * fine.depth(x, y) + (1 - known) * around.depth();
      fine.weight(x, y) = 1;
    }
  }
}

}  // namespace

PulledLevel pulled_and_pushed(PulledLevel finest, size_t narrow) {
  std::vector<PulledLevel> levels;
  levels.push_back(std::move(finest));
  while (levels.back().color.width > 1 || levels.back().color.height > 1) {
    levels.push_back(pulled(levels.back(), levels.size() <= narrow));
  }
  for (size_t k = levels.size() - 1; k-- > 0;) push(levels[k + 1], k < narrow, levels[k]);
  return std::move(levels.front());
}

}  // namespace cgs
