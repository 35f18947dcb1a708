// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/hidden_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "libcgs/render/membrane.h"
#include "libcgs/render/pull_push.h"

namespace cgs {

namespace {

constexpr float kNoDepth = std::numeric_limits<float>::quiet_NaN();

// Depth that may hold the membrane.
DepthMap depth_around(const RenderBuffers& buffers, const MaskMap& open, bool with_sky) {
  DepthMap out(open.width, open.height, kNoDepth);
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float depth = buffers.median_depth.data[i];
    const bool is_sky = buffers.hole.data[i] == Hole::Sky;
    if (open.data[i] == 0 && depth > 0 && std::isfinite(depth) && (with_sky || !is_sky)) {
      out.data[i] = depth;
    }
  }
  return out;
}

bool has_any(const DepthMap& depth) {
  return std::any_of(depth.data.begin(), depth.data.end(), [](float z) { return z > 0; });
}

// Where the membrane starts: means that lean to the far side in gaps of any width.
DepthMap leaning_depth(const DepthMap& around) {
  PulledLevel finest(around.width, around.height);
  for (size_t i = 0; i < around.data.size(); ++i) {
    if (!(around.data[i] > 0)) continue;
    finest.depth.data[i] = around.data[i];
    finest.weight.data[i] = 1;
  }
  constexpr size_t kAnyWidth = 64;
  return pulled_and_pushed(std::move(finest), kAnyWidth).depth;
}

// Relaxes inverse depth in gaps, held where the depth beside them is not before that found so far.
// \return by how many pixels it is held
size_t relax_held(const DepthMap& around, const MaskMap& open, DepthMap& found) {
  Raster<MembranePixel> pixels(open.width, open.height, MembranePixel::Outside);
  Raster<float> inverse(open.width, open.height, 0);
  for (int y = 0; y < open.height; ++y) {
    for (int x = 0; x < open.width; ++x) {
      if (open(x, y) == 0) continue;
      pixels(x, y) = MembranePixel::Open;
      inverse(x, y) = 1 / found(x, y);
      for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
        if (!open.contains(x + dx, y + dy)) continue;
        const float beside = around(x + dx, y + dy);
        if (!(beside >= kFarSide * found(x, y))) continue;  // also if unknown
        pixels(x + dx, y + dy) = MembranePixel::Fixed;
        inverse(x + dx, y + dy) = 1 / beside;
      }
    }
  }
  constexpr int kSweeps = 300;
  relax_membrane(inverse, pixels, 0, kSweeps);
  for (size_t i = 0; i < found.data.size(); ++i) {
    if (open.data[i] != 0) found.data[i] = inverse.data[i] > 0 ? 1 / inverse.data[i] : kNoDepth;
  }
  const auto is_held = [](MembranePixel pixel) { return pixel == MembranePixel::Fixed; };
  return static_cast<size_t>(std::count_if(pixels.data.begin(), pixels.data.end(), is_held));
}

}  // namespace

DepthMap hidden_depth(const RenderBuffers& buffers, const MaskMap& open) {
  DepthMap around = depth_around(buffers, open, /*with_sky=*/false);
  if (!has_any(around)) around = depth_around(buffers, open, /*with_sky=*/true);
  if (!has_any(around)) return around;
  DepthMap found = leaning_depth(around);
  for (size_t i = 0; i < found.data.size(); ++i) {
    if (open.data[i] == 0) found.data[i] = kNoDepth;
  }
  // A slanted surface is nearer on one side, too, which is told from what stands before it only
  // once the others hold the membrane.
  constexpr int kMostRounds = 12;
  size_t held = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const size_t now = relax_held(around, open, found);
    if (now == held) break;
    held = now;
  }
  return found;
}

}  // namespace cgs
