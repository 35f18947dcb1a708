// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libcgs/core/order_statistics.h"
#include "libcgs/render/pull_push.h"

namespace cgs {

namespace {

constexpr float kShown = 0.5f;  // alpha from which on a pixel has a colour of its own
constexpr size_t kNarrow = 5;   // halvings within which a gap is one behind an edge: 32 pixels

// Depth from which on something is the backdrop that sky is painted on, in holes, too.
float backdrop_depth(const DepthMap& depth, const Raster<Hole>& hole) {
  std::vector<float> of_sky;
  for (size_t i = 0; i < hole.data.size(); ++i) {
    if (hole.data[i] == Hole::Sky && std::isfinite(depth.data[i])) of_sky.push_back(depth.data[i]);
  }
  return of_sky.empty() ? std::numeric_limits<float>::infinity() : 0.5f * median(of_sky);
}

// The backdrop of the sky is not to be preferred as if it were far: no ground goes on with it.
PulledLevel shown_pixels(const ColorImage& shown, const RenderBuffers& buffers) {
  PulledLevel out(shown.width, shown.height);
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

}  // namespace

ColorImage picture(const RenderBuffers& buffers, const Eigen::Vector3f& background) {
  ColorImage out = buffers.color;
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float alpha = buffers.alpha.data[i];
    if (alpha >= kShown) {
      out.data[i] /= alpha;
    } else {
      out.data[i] += (1 - alpha) * background;
    }
    out.data[i] = out.data[i].cwiseMax(0.0f).cwiseMin(1.0f);
  }
  return out;
}

ColorImage filled_picture(const RenderBuffers& buffers) {
  ColorImage out = picture(buffers);
  const ColorImage around = pulled_and_pushed(shown_pixels(out, buffers), kNarrow).color;
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float alpha = buffers.alpha.data[i];
    if (alpha >= kShown) continue;
    out.data[i] =
        (buffers.color.data[i] + (1 - alpha) * around.data[i]).cwiseMax(0.0f).cwiseMin(1.0f);
  }
  return out;
}

RenderBuffers with_fill(RenderBuffers buffers, const RenderBuffers& fill) {
  for (size_t i = 0; i < buffers.color.data.size(); ++i) {
    if (!is_hole(buffers.hole.data[i])) continue;
    const float behind = 1 - fill.alpha.data[i];
    if (shows_fill(buffers, fill, i)) buffers.median_depth.data[i] = fill.median_depth.data[i];
    buffers.color.data[i] = fill.color.data[i] + behind * buffers.color.data[i];
    buffers.alpha.data[i] = fill.alpha.data[i] + behind * buffers.alpha.data[i];
  }
  return buffers;
}

}  // namespace cgs
