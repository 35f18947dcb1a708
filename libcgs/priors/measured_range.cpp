// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/measured_range.h"

#include <algorithm>
#include <vector>

#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr int kReduction = 4;

// Means of 4 x 4 pixels; what remains at the right and lower border is left out.
View reduced(const View& view) {
  View out = view;
  out.camera.width = view.camera.width / kReduction;
  out.camera.height = view.camera.height / kReduction;
  for (double* value : {&out.camera.fx, &out.camera.fy, &out.camera.cx, &out.camera.cy}) {
    *value /= kReduction;
  }
  out.image = ColorImage(out.camera.width, out.camera.height, Eigen::Vector3f::Zero());
  if (!view.valid.empty()) out.valid = MaskMap(out.camera.width, out.camera.height, 1);
  for (int y = 0; y < out.camera.height * kReduction; ++y) {
    for (int x = 0; x < out.camera.width * kReduction; ++x) {
      out.image(x / kReduction, y / kReduction) += view.image(x, y) / (kReduction * kReduction);
      if (!view.valid.empty()) out.valid(x / kReduction, y / kReduction) &= view.valid(x, y);
    }
  }
  return out;
}

// The range that holds the measured depths but for one in a hundred at each end, with a margin for
// what the small images could not show.
DepthRange range_of(std::vector<float> depths, const DepthRange& guess) {
  constexpr double kNearMargin = 0.75;
  constexpr double kFarMargin = 1.5;
  const size_t trimmed = depths.size() / 100;
  return {
      std::max(guess.near, kNearMargin * double{nth_smallest(depths, trimmed)}),
      std::min(guess.far, kFarMargin * double{nth_smallest(depths, depths.size() - 1 - trimmed)})};
}

}  // namespace

void narrow_depth_ranges(Scene& scene, const PlaneSweepOptions& options) {
  const auto states_range = [&](int i) {
    const View& view = scene.views[static_cast<size_t>(i)];
    return view.near > 0 && view.far > view.near;
  };
  if (std::all_of(scene.input.begin(), scene.input.end(), states_range)) return;
  Scene small;
  small.folder = scene.folder;
  small.points = scene.points;
  for (size_t k = 0; k < scene.input.size(); ++k) {
    small.views.push_back(reduced(scene.views[static_cast<size_t>(scene.input[k])]));
    small.input.push_back(static_cast<int>(k));
  }
  PlaneSweepOptions coarse = options;
  coarse.least_disparity /= kReduction;  // what the full sweep can tell must lie in the range
  const std::vector<ViewPriors> measured = plane_sweep(small, coarse);
  for (size_t k = 0; k < measured.size(); ++k) {
    if (states_range(scene.input[k])) continue;
    std::vector<float> depths;
    for (size_t i = 0; i < measured[k].depth.data.size(); ++i) {
      if (measured[k].origin.data[i] == DepthOrigin::Measured) {
        depths.push_back(measured[k].depth.data[i]);
      }
    }
    // A fifth of a picture of four pixels is none: there must be at least one depth.
    if (depths.empty() || 5 * depths.size() < measured[k].depth.data.size()) continue;
    const DepthRange range = range_of(std::move(depths), depth_range(scene, scene.input[k]));
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    view.near = range.near;
    view.far = range.far;
  }
}

}  // namespace cgs
