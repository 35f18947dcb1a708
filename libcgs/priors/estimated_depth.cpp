// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/estimated_depth.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/directions.h"

namespace cgs {

namespace {

constexpr float kFar = std::numeric_limits<float>::max();

bool is_filled(DepthOrigin origin) {
  return origin == DepthOrigin::Completed || origin == DepthOrigin::Guessed;
}

// Relative to the nearer one.
float depth_step(float a, float b) { return std::abs(a - b) / std::min(a, b); }

// Shortest ways from the measured pixels over filled ones, up to a longest.
class Ways {
 public:
  Ways(const ViewPriors& priors, const View& view, const AdjoiningOptions& options)
      : priors_(priors),
        view_(view),
        options_(options),
        way_(priors.depth.width, priors.depth.height, kFar) {
    for (int y = 0; y < way_.height; ++y) {
      for (int x = 0; x < way_.width; ++x) {
        if (priors_.origin(x, y) == DepthOrigin::Measured) way_(x, y) = 0;
      }
    }
    for (int y = 0; y < way_.height; ++y) {
      for (int x = 0; x < way_.width; ++x) {
        if (way_(x, y) == 0) go_on_from(x, y);
      }
    }
    while (!open_.empty()) {
      const auto [way, x, y] = open_.top();
      open_.pop();
      if (way == way_(x, y)) go_on_from(x, y);
    }
  }

  float to(int x, int y) const { return way_(x, y); }

 private:
  using Open = std::tuple<float, int, int>;  // way, x, y

  void go_on_from(int x, int y) {
    for (const Direction d : std::span(kDirections).first<8>()) {
      const int u = x + d.dx;
      const int v = y + d.dy;
      if (!way_.contains(u, v) || !is_filled(priors_.origin(u, v))) continue;
      if (depth_step(priors_.depth(x, y), priors_.depth(u, v)) > options_.largest_step) continue;
      const float change = (view_.image(x, y) - view_.image(u, v)).cwiseAbs().maxCoeff();
      const float stride = std::hypot(static_cast<float>(d.dx), static_cast<float>(d.dy));
      const float way = way_(x, y) + stride + change / options_.level_scale;
      if (way > options_.way || way >= way_(u, v)) continue;
      way_(u, v) = way;
      open_.emplace(way, u, v);
    }
  }

  const ViewPriors& priors_;
  const View& view_;
  const AdjoiningOptions& options_;
  Raster<float> way_;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open_;
};

// Steps to the nearest pixel that was measured or guessed, in any direction [pixels].
Raster<int> steps_to_known(const ViewPriors& priors) {
  const auto& origin = priors.origin;
  const int farthest = origin.width + origin.height;
  Raster<int> out(origin.width, origin.height, farthest);
  std::vector<std::pair<int, int>> reached;
  for (int y = 0; y < origin.height; ++y) {
    for (int x = 0; x < origin.width; ++x) {
      const DepthOrigin here = origin(x, y);
      if (here != DepthOrigin::Measured && here != DepthOrigin::Guessed) continue;
      out(x, y) = 0;
      reached.emplace_back(x, y);
    }
  }
  for (size_t i = 0; i < reached.size(); ++i) {
    const auto [x, y] = reached[i];
    for (const Direction d : std::span(kDirections).first<8>()) {
      if (!out.contains(x + d.dx, y + d.dy) || out(x + d.dx, y + d.dy) < farthest) continue;
      out(x + d.dx, y + d.dy) = out(x, y) + 1;
      reached.emplace_back(x + d.dx, y + d.dy);
    }
  }
  return out;
}

}  // namespace

void AdjoiningOptions::validate() const {
  require(way >= 0, "AdjoiningOptions.way must be >= 0", way);
  require(level_scale > 0, "AdjoiningOptions.level_scale must be > 0", level_scale);
  require(largest_step > 0, "AdjoiningOptions.largest_step must be > 0", largest_step);
}

void mark_estimated(ViewPriors& priors, const View& view, const AdjoiningOptions& options) {
  options.validate();
  const Ways ways(priors, view, options);
  for (int y = 0; y < priors.origin.height; ++y) {
    for (int x = 0; x < priors.origin.width; ++x) {
      if (!is_filled(priors.origin(x, y)) || ways.to(x, y) < kFar) continue;
      priors.origin(x, y) = DepthOrigin::Estimated;
    }
  }
}

void limit_completion(ViewPriors& priors) {
  const Raster<int> steps = steps_to_known(priors);
  std::vector<int> of_completed;
  size_t known = 0;
  for (size_t i = 0; i < steps.data.size(); ++i) {
    known += steps.data[i] == 0 ? 1 : 0;
    if (priors.origin.data[i] == DepthOrigin::Completed) of_completed.push_back(steps.data[i]);
  }
  if (of_completed.size() <= known) return;
  const int first_beyond = nth_smallest(of_completed, known);
  for (size_t i = 0; i < steps.data.size(); ++i) {
    if (priors.origin.data[i] != DepthOrigin::Completed || steps.data[i] < first_beyond) continue;
    priors.origin.data[i] = DepthOrigin::Unknown;
    priors.depth.data[i] = priors.sigma.data[i] = std::nanf("");
  }
}

namespace {

bool is_evident(DepthOrigin origin) { return origin == DepthOrigin::Measured || is_filled(origin); }

// Estimated pixels of one surface, and what their rim is, in sides of pixels.
struct EstimatedPatch {
  std::vector<std::pair<int, int>> pixels;
  size_t rim = 0;
  size_t framed = 0;  // goes on in pixels with evidence
  size_t open = 0;    // at the border of the picture, at sky, or at what nothing is known of
};

// The patch around a pixel; takes its pixels out of `left`.
EstimatedPatch estimated_patch(const ViewPriors& priors, int x0, int y0, MaskMap& left) {
  constexpr float kOneSurface = 0.03f;  // step of depth
  EstimatedPatch out;
  out.pixels = {{x0, y0}};
  left(x0, y0) = 0;
  for (size_t i = 0; i < out.pixels.size(); ++i) {
    const auto [x, y] = out.pixels[i];
    for (const Direction d : kNeighbors) {
      const int u = x + d.dx;
      const int v = y + d.dy;
      const DepthOrigin there =
          priors.origin.contains(u, v) ? priors.origin(u, v) : DepthOrigin::Unknown;
      const bool is_open = there == DepthOrigin::Unknown || shows_no_surface(there);
      const bool goes_on =
          !is_open && depth_step(priors.depth(x, y), priors.depth(u, v)) <= kOneSurface;
      if (goes_on && is_estimated(there)) {
        if (left(u, v) != 0) out.pixels.emplace_back(u, v);
        left(u, v) = 0;
        continue;
      }
      ++out.rim;
      out.framed += goes_on ? 1 : 0;
      out.open += is_open ? 1 : 0;
    }
  }
  return out;
}

}  // namespace

MaskMap framed_estimates(const ViewPriors& priors) {
  constexpr double kLargest = 0.25;     // of the pixels with evidence
  constexpr double kLeastFramed = 0.5;  // of the rim
  constexpr double kMostOpen = 0.25;    // of the rim
  const auto& origins = priors.origin.data;
  const auto evident = double(std::count_if(origins.begin(), origins.end(), is_evident));
  MaskMap out(priors.origin.width, priors.origin.height, 0);
  MaskMap left = out;
  std::transform(origins.begin(), origins.end(), left.data.begin(), [](DepthOrigin origin) {
    return is_estimated(origin) ? 1 : 0;
  });
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      if (left(x, y) == 0) continue;
      const EstimatedPatch patch = estimated_patch(priors, x, y, left);
      const auto rim = double(patch.rim);
      const bool is_framed = double(patch.pixels.size()) <= kLargest * evident &&
                             double(patch.framed) >= kLeastFramed * rim &&
                             double(patch.open) <= kMostOpen * rim;
      if (!is_framed) continue;
      for (const auto& [u, v] : patch.pixels) out(u, v) = 1;
    }
  }
  return out;
}

}  // namespace cgs
