// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr float kShown = 0.5f;  // alpha from which on a pixel has a colour of its own
constexpr size_t kNarrow = 5;   // halvings within which a gap is one behind an edge: 32 pixels

/// Colours of one size of the picture, and how much is known of each: 0 to 1.
struct Level {
  ColorImage color;
  Raster<float> weight;
  DepthMap depth;  // where the weight is above 0

  Level(int width, int height)
      : color(width, height, Eigen::Vector3f::Zero()),
        weight(width, height, 0),
        depth(width, height, 0) {}
};

/// A weighted mean. In narrow gaps it leans to what is far: at half the depth a colour counts a
/// 256th. Wide ones are no gaps behind an edge.
class FarMean {
 public:
  explicit FarMean(bool is_narrow) : is_narrow_(is_narrow) {}

  void add(const Level& level, int x, int y, float share) {
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

// Depth from which on something is the backdrop that sky is painted on, in holes, too.
float backdrop_depth(const DepthMap& depth, const Raster<Hole>& hole) {
  std::vector<float> of_sky;
  for (size_t i = 0; i < hole.data.size(); ++i) {
    if (hole.data[i] == Hole::Sky && std::isfinite(depth.data[i])) of_sky.push_back(depth.data[i]);
  }
  return of_sky.empty() ? std::numeric_limits<float>::infinity() : 0.5f * median(of_sky);
}

// The backdrop of the sky is not to be preferred as if it were far: no ground goes on with it.
Level shown_pixels(const ColorImage& shown, const RenderBuffers& buffers) {
  Level out(shown.width, shown.height);
  const float backdrop = backdrop_depth(buffers.median_depth, buffers.hole);
  std::vector<float> of_surface;
  for (size_t i = 0; i < shown.data.size(); ++i) {
    const float depth = buffers.median_depth.data[i];
    if (!(buffers.alpha.data[i] >= kShown) || !(depth > 0) || !std::isfinite(depth)) continue;
    out.color.data[i] = shown.data[i];
    out.depth.data[i] = depth;
    out.weight.data[i] = 1;
    if (depth < backdrop) of_surface.push_back(depth);
  }
  if (of_surface.empty()) return out;
  const float middle = median(of_surface);
  for (float& depth : out.depth.data) depth = depth < backdrop ? depth : middle;
  return out;
}

// Half the size: what four pixels know together.
Level pulled(const Level& fine, bool is_narrow) {
  Level out((fine.color.width + 1) / 2, (fine.color.height + 1) / 2);
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
void push(const Level& coarse, bool is_narrow, Level& fine) {
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

ColorImage picture(const RenderBuffers& buffers) {
  ColorImage out = buffers.color;
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float alpha = buffers.alpha.data[i];
    if (alpha >= kShown) out.data[i] /= alpha;
    out.data[i] = out.data[i].cwiseMax(0.0f).cwiseMin(1.0f);
  }
  return out;
}

ColorImage filled_picture(const RenderBuffers& buffers) {
  ColorImage out = picture(buffers);
  std::vector<Level> levels;
  levels.push_back(shown_pixels(out, buffers));
  while (levels.back().color.width > 1 || levels.back().color.height > 1) {
    levels.push_back(pulled(levels.back(), levels.size() <= kNarrow));
  }
  for (size_t k = levels.size() - 1; k-- > 0;) push(levels[k + 1], k < kNarrow, levels[k]);
  const ColorImage& around = levels.front().color;
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float alpha = buffers.alpha.data[i];
    if (alpha >= kShown) continue;
    out.data[i] =
        (buffers.color.data[i] + (1 - alpha) * around.data[i]).cwiseMax(0.0f).cwiseMin(1.0f);
  }
  return out;
}

}  // namespace cgs
