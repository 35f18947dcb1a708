// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_completion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/directions.h"
#include "libcgs/priors/empty_space.h"

namespace cgs {

namespace {

struct Evidence {
  float inverse_depth = 0;
  float weight = 0;
  float distance = 0;  // [pixels]
};

// What completion knows about a pixel.
struct Filled {
  float inverse_depth = kNaN;
  float spread = 0;    // of the evidence [1 / internal units]
  float distance = 0;  // to the nearest evidence [pixels]
};

class Completion {
 public:
  Completion(const ViewPriors& priors,
             const View& view,
             const DepthCompletionOptions& options,
             const std::vector<CompletionWitness>& witnesses)
      : priors_(priors),
        view_(view),
        options_(options),
        filled_(priors.depth.width, priors.depth.height, Filled{}) {
    for (const CompletionWitness& witness : witnesses) empty_.emplace_back(view.camera, witness);
  }

  bool usable(int x, int y) const {
    return view_.is_usable(x, y) && !shows_no_surface(priors_.origin(x, y));
  }
  bool is_sky(int x, int y) const { return priors_.origin(x, y) == DepthOrigin::Sky; }
  bool measured(int x, int y) const { return priors_.origin(x, y) == DepthOrigin::Measured; }
  const Raster<Filled>& filled() const { return filled_; }

  void collect(float fallback, const Progress& progress) {
    SharedProgress shared(progress, static_cast<size_t>(filled_.height));
    tbb::parallel_for(0, filled_.height, [&](int y) {
      for (int x = 0; x < filled_.width; ++x) {
        if (!usable(x, y)) continue;
        filled_(x, y) =
            measured(x, y) ? Filled{1 / priors_.depth(x, y), 0, 0} : estimate(x, y, fallback);
      }
      shared.advance();
    });
  }

  // Takes out of the way of witnesses what smoothing brought there.
  void clear_sights() {
    tbb::parallel_for(0, filled_.height, [&](int y) {
      for (int x = 0; x < filled_.width; ++x) {
        if (!usable(x, y) || measured(x, y)) continue;
        float& rho = filled_(x, y).inverse_depth;
        rho = behind_empty(x, y, rho);
      }
    });
  }

  // Weighted averages over neighbours of like colour and depth, as on a chessboard.
  void smooth(const Progress& progress) {
    for (int k = 0; k < 2 * options_.smoothing_rounds; ++k) {
      report(progress, double(k) / (2 * options_.smoothing_rounds));
      tbb::parallel_for(0, filled_.height, [&](int y) {
        for (int x = (y + k) % 2; x < filled_.width; x += 2) {
          if (usable(x, y) && !measured(x, y)) relax(x, y);
        }
      });
    }
  }

 private:
  float color_change(int x0, int y0, int x1, int y1) const {
    return (view_.image(x0, y0) - view_.image(x1, y1)).cwiseAbs().maxCoeff();
  }

  std::optional<Evidence> first_measured(int x, int y, Direction d) const {
    const float stride = std::hypot(static_cast<float>(d.dx), static_cast<float>(d.dy));
    float way = 0;
    int steps = 0;
    for (int u = x, v = y;;) {
      const int next_u = u + d.dx;
      const int next_v = v + d.dy;
      if (!filled_.contains(next_u, next_v) || is_sky(next_u, next_v)) return std::nullopt;
      ++steps;
      // Masked pixels have no colour to compare; the way through them counts.
      way += stride;
      if (usable(u, v) && usable(next_u, next_v)) {
        way += color_change(u, v, next_u, next_v) / options_.level_scale;
      }
      u = next_u;
      v = next_v;
      if (!measured(u, v)) continue;
      const float here = color_change(x, y, u, v) / options_.level_scale;
      const float cost = way + here;
      return Evidence{1 / priors_.depth(u, v), 1 / (cost * cost), stride * float(steps)};
    }
  }

  bool empty(int x, int y, float inverse_depth) const {
    return std::any_of(empty_.begin(), empty_.end(), [&](const EmptySpace& space) {
      return space.holds(x, y, inverse_depth);
    });
  }

  // The nearest place that no witness sees past, from the given one backwards to nearly three times
  // its depth; NaN where there is none.
  float behind_empty(int x, int y, float inverse_depth) const {
    constexpr float kStep = 0.98f;
    constexpr int kSteps = 50;
    float rho = inverse_depth;
    for (int k = 0; k < kSteps; ++k, rho *= kStep) {
      if (!empty(x, y, rho)) return rho;
    }
    return kNaN;
  }

  Filled estimate(int x, int y, float fallback) const {
    std::array<Evidence, kDirections.size()> found;
    size_t count = 0;
    for (const Direction d : kDirections) {
      if (const auto evidence = first_measured(x, y, d)) found[count++] = *evidence;
    }
    const auto whole = static_cast<float>(std::hypot(filled_.width, filled_.height));
    if (count == 0) return {fallback, 0, whole};
    auto end = found.begin() + static_cast<std::ptrdiff_t>(count);
    std::sort(found.begin(), end, [](const Evidence& a, const Evidence& b) {
      return a.inverse_depth < b.inverse_depth;
    });
    const auto possible = std::remove_if(
        found.begin(), end, [&](const Evidence& e) { return empty(x, y, e.inverse_depth); });
    if (possible == found.begin()) {
      found[0].inverse_depth = behind_empty(x, y, found[0].inverse_depth);
      end = found.begin() + 1;
    } else {
      end = possible;
    }
    float total = 0;
    Filled out{found[0].inverse_depth, 0, whole};
    for (auto e = found.begin(); e != end; ++e) {
      total += e->weight;
      out.distance = std::min(out.distance, e->distance);
    }
    float passed = 0;
    for (auto e = found.begin(); e != end; ++e) {
      out.inverse_depth = e->inverse_depth;
      passed += e->weight;
      if (passed >= options_.background_share * total) break;
    }
    for (auto e = found.begin(); e != end; ++e) {
      const float d = e->inverse_depth - out.inverse_depth;
      out.spread += e->weight / total * d * d;
    }
    out.spread = std::sqrt(out.spread);
    return out;
  }

  void relax(int x, int y) {
    // Relative step of inverse depth. In a wide gap the two sides of one slanted surface may have
    // come further apart than in a narrow one.
    constexpr float kSameSurface = 0.05f;
    constexpr float kSlope = 0.01f;  // [1 / pixel]
    constexpr float kLargest = 0.12f;
    Filled& here = filled_(x, y);
    const float step = std::min(kSameSurface + kSlope * here.distance, kLargest);
    float sum = 0;
    float weight = 0;
    for (const Direction d : kNeighbors) {
      const int u = x + d.dx;
      const int v = y + d.dy;
      if (!filled_.contains(u, v) || !usable(u, v)) continue;
      const float there = filled_(u, v).inverse_depth;
      const float change_of_depth = std::abs(there - here.inverse_depth);
      if (!(change_of_depth <= step * here.inverse_depth)) continue;  // also if unknown
      const float change = color_change(x, y, u, v) / options_.level_scale;
      const float w = 1 / (1 + change * change);
      sum += w * there;
      weight += w;
    }
    if (weight > 0) here.inverse_depth = sum / weight;
  }

  const ViewPriors& priors_;
  const View& view_;
  const DepthCompletionOptions& options_;
  std::vector<EmptySpace> empty_;
  Raster<Filled> filled_;
};

// For pixels that no ray leads from to a measured one.
float fallback_inverse_depth(const ViewPriors& priors, const DepthCompletionOptions& options) {
  std::vector<float> known;
  for (size_t i = 0; i < priors.depth.data.size(); ++i) {
    if (priors.origin.data[i] == DepthOrigin::Measured) known.push_back(1 / priors.depth.data[i]);
  }
  if (!known.empty()) return median(known);
  if (options.fallback_depth > 0) return static_cast<float>(1 / options.fallback_depth);
  throw NumericalError("no pixel of a view has a measured depth to complete from");
}

}  // namespace

void DepthCompletionOptions::validate() const {
  require(
      fallback_depth >= 0, "DepthCompletionOptions.fallback_depth must be >= 0", fallback_depth);
  require(level_scale > 0, "DepthCompletionOptions.level_scale must be > 0", level_scale);
  require(background_share >= 0 && background_share <= 1,
          "DepthCompletionOptions.background_share must be in [0, 1]",
          background_share);
  require(
      sigma_per_pixel >= 0, "DepthCompletionOptions.sigma_per_pixel must be >= 0", sigma_per_pixel);
  require(smoothing_rounds >= 0 && smoothing_rounds <= 10000,
          "DepthCompletionOptions.smoothing_rounds must be in [0, 10000]",
          smoothing_rounds);
}

float filled_sigma(float spread, float way, float sigma_per_pixel) {
  constexpr float kFloor = 0.02f;  // next to the evidence
  constexpr float kCap = 0.5f;
  return std::min(kFloor + spread + sigma_per_pixel * way, kCap);
}

void complete_depth(ViewPriors& priors,
                    const View& view,
                    const DepthCompletionOptions& options,
                    const std::vector<CompletionWitness>& witnesses,
                    const Progress& progress) {
  options.validate();
  Completion completion(priors, view, options, witnesses);
  completion.collect(fallback_inverse_depth(priors, options), part_of(progress, 0, 0.5));
  completion.smooth(part_of(progress, 0.5, 1));
  completion.clear_sights();
  for (int y = 0; y < priors.depth.height; ++y) {
    for (int x = 0; x < priors.depth.width; ++x) {
      if (!completion.usable(x, y) || completion.measured(x, y)) continue;
      const Filled& filled = completion.filled()(x, y);
      if (std::isnan(filled.inverse_depth)) continue;
      const float relative = filled_sigma(
          filled.spread / filled.inverse_depth, filled.distance, options.sigma_per_pixel);
      priors.depth(x, y) = 1 / filled.inverse_depth;
      priors.sigma(x, y) = relative / filled.inverse_depth;
      priors.origin(x, y) = DepthOrigin::Completed;
    }
  }
}

}  // namespace cgs
