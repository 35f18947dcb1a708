// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/measured_range.h"

#include <algorithm>
#include <vector>

#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/reduced_view.h"

namespace cgs {

namespace {

constexpr int kReduction = 4;

// Depths but for a share of them at each end.
DepthRange trimmed(std::vector<float> depths, size_t one_in) {
  const size_t left_out = depths.size() / one_in;
  return {double{nth_smallest(depths, left_out)},
          double{nth_smallest(depths, depths.size() - 1 - left_out)}};
}

// The range that holds what was measured, zero where that is little, with a margin for what the
// small images could not show. What two views agree on may be chance, in patches of up to half a
// per cent of a picture. What a third one confirms hardly is, and a thing in the foreground may
// fill no more: outside the range it would come out at another depth. Planes lie evenly in inverse
// depth: room behind costs few of them, room in front many.
DepthRange range_of(const ViewPriors& measured, const DepthRange& guess) {
  constexpr double kNearMargin = 0.5;
  constexpr double kFarMargin = 2.5;
  constexpr size_t kOneInOfAll = 100;
  constexpr size_t kOneInOfSure = 1000;
  std::vector<float> all;
  std::vector<float> sure;
  for (size_t i = 0; i < measured.depth.data.size(); ++i) {
    if (measured.origin.data[i] != DepthOrigin::Measured) continue;
    all.push_back(measured.depth.data[i]);
    if (measured.matched_views.data[i] >= 2) sure.push_back(measured.depth.data[i]);
  }
  // A fifth of a picture of four pixels is none: there must be at least one depth.
  if (all.empty() || 5 * all.size() < measured.depth.data.size()) return {};
  DepthRange out = trimmed(std::move(all), kOneInOfAll);
  if (!sure.empty()) {
    const DepthRange of_sure = trimmed(std::move(sure), kOneInOfSure);
    out = {std::min(out.near, of_sure.near), std::max(out.far, of_sure.far)};
  }
  return {std::max(guess.near, kNearMargin * out.near), std::min(guess.far, kFarMargin * out.far)};
}

}  // namespace

void narrow_depth_ranges(Scene& scene, const PlaneSweepOptions& options, const Progress& progress) {
  const auto states_range = [&](int i) {
    const View& view = scene.views[static_cast<size_t>(i)];
    return view.near > 0 && view.far > view.near;
  };
  if (std::all_of(scene.input.begin(), scene.input.end(), states_range)) return;
  const Scene small = reduced_inputs(scene, kReduction);
  PlaneSweepOptions coarse = options;
  coarse.least_disparity /= kReduction;  // what the full sweep can tell must lie in the range
  const std::vector<ViewPriors> measured = plane_sweep(small, coarse, progress);
  for (size_t k = 0; k < measured.size(); ++k) {
    if (states_range(scene.input[k])) continue;
    const DepthRange range = range_of(measured[k], depth_range(scene, scene.input[k]));
    if (!(range.far > 0)) continue;
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    view.near = range.near;
    view.far = range.far;
  }
}

}  // namespace cgs
