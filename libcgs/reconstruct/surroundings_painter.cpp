// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/surroundings_painter.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/nan.h"
#include "libcgs/render/exemplar_fill.h"
#include "libcgs/render/picture.h"

namespace cgs {

namespace {

/// The pixel next to a hole that an input view shows, by steps from pixel to pixel.
struct NextShown {
  int distance = 0;  // [pixels]; < 0 = there is none
  bool is_sky = false;
};

Raster<NextShown> next_shown(const ViewToPaint& view) {
  const MaskMap& open = view.open;
  Raster<NextShown> out(open.width, open.height, NextShown{-1, false});
  std::vector<std::pair<int, int>> reached;
  for (int y = 0; y < open.height; ++y) {
    for (int x = 0; x < open.width; ++x) {
      if (is_hole(view.shown.hole(x, y))) continue;
      out(x, y) = {0, view.shown.hole(x, y) == Hole::Sky};
      reached.emplace_back(x, y);
    }
  }
  for (size_t i = 0; i < reached.size(); ++i) {
    const auto [x, y] = reached[i];
    for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
      if (!open.contains(x + dx, y + dy) || out(x + dx, y + dy).distance >= 0) continue;
      out(x + dx, y + dy) = {out(x, y).distance + 1, out(x, y).is_sky};
      reached.emplace_back(x + dx, y + dy);
    }
  }
  return out;
}

// Whether an input view looks at what a hole hides, and knows no surface there.
bool is_looked_at(const ViewToPaint& view, int x, int y) {
  const Eigen::Vector3d point = view.camera.unproject(x + 0.5, y + 0.5, double{view.hidden(x, y)});
  return std::any_of(view.inputs.begin(), view.inputs.end(), [&](const SupportView& input) {
    const Eigen::Vector3d uvz = input.camera.project(point);
    if (!input.camera.sees(uvz)) return false;
    const size_t at = input.depth.index(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
    const bool is_sky = !input.evidence.empty() && input.evidence.data[at] == DepthEvidence::Sky;
    return is_sky || std::isnan(input.depth.data[at]);
  });
}

// Leaves connected gaps open as a whole if half or more of them is set: a rest that is painted
// would be slivers in the middle of what a photograph looks at.
void spread_over_gaps(const MaskMap& open, MaskMap& left_open) {
  MaskMap reached(open.width, open.height, 0);
  std::vector<std::pair<int, int>> gap;
  for (int start = 0; start < static_cast<int>(open.data.size()); ++start) {
    gap.clear();
    const auto reach = [&](int x, int y) {
      if (!open.contains(x, y) || open(x, y) == 0 || reached(x, y) != 0) return;
      reached(x, y) = 1;
      gap.emplace_back(x, y);
    };
    reach(start % open.width, start / open.width);
    size_t set = 0;
    for (size_t i = 0; i < gap.size(); ++i) {
      const auto [x, y] = gap[i];
      set += left_open(x, y);
      for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
        reach(x + dx, y + dy);
      }
    }
    if (2 * set < gap.size()) continue;
    for (const auto& [x, y] : gap) left_open(x, y) = 1;
  }
}

// Depth as exemplar_fill() takes it.
DepthMap depth_of_pieces(const ViewToPaint& view, const MaskMap& left_open) {
  DepthMap out = view.shown.median_depth;
  for (size_t i = 0; i < out.data.size(); ++i) {
    if (view.shown.hole.data[i] == Hole::Sky) out.data[i] = kNaN;
    if (view.open.data[i] != 0) out.data[i] = left_open.data[i] != 0 ? 0 : view.hidden.data[i];
  }
  return out;
}

}  // namespace

MaskMap holes_left_open(const ViewToPaint& view) {
  constexpr int kWidths = 12;
  const Raster<NextShown> next = next_shown(view);
  MaskMap out(view.open.width, view.open.height, 0);
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      if (view.open(x, y) == 0) continue;
      const bool is_nowhere = std::isnan(view.hidden(x, y));
      if (is_nowhere || next(x, y).is_sky || is_looked_at(view, x, y)) out(x, y) = 1;
    }
  });
  spread_over_gaps(view.open, out);
  for (size_t i = 0; i < out.data.size(); ++i) {
    const int distance = next.data[i].distance;
    const bool is_far = distance < 0 || kWidths * distance > out.width;
    if (is_far && view.open.data[i] != 0) out.data[i] = 1;
  }
  return out;
}

PaintedSurroundings painted_surroundings(const ViewToPaint& view) {
  PaintedSurroundings out;
  out.left_open = holes_left_open(view);
  MaskMap painted = view.open;
  for (size_t i = 0; i < painted.data.size(); ++i) {
    if (out.left_open.data[i] != 0) painted.data[i] = 0;
  }
  const DepthMap depth = depth_of_pieces(view, out.left_open);
  out.picture = exemplar_fill(filled_picture(view.shown), painted, depth);
  return out;
}

}  // namespace cgs
