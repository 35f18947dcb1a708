// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

// What the pairs of neighbours of one view weigh.
struct SmoothedView {
  const DepthMap& depth;
  const ColorPlanes& photograph;
  const DepthMap& measured;

  bool is_known(size_t i) const { return depth.data[i] > 0 && std::isfinite(depth.data[i]); }
  // exp(-10 mean |difference of colours|); 0 where the pair does not count.
  double weight(size_t i, size_t j) const {
    constexpr double kPerColor = 10;
    if (!is_known(i) || !is_known(j)) return 0;
    if (std::isfinite(measured.data[i]) && std::isfinite(measured.data[j])) return 0;
    double apart = 0;
    for (const Raster<float>& plane : photograph) {
      apart += std::abs(double(plane.data[i]) - double(plane.data[j]));
    }
    return std::exp(-kPerColor * apart / 3);
  }
  // log(depth of i / depth of j)
  double step(size_t i, size_t j) const {
    return std::log(double(depth.data[i]) / double(depth.data[j]));
  }
};

double sign_of(double value) { return double(value > 0) - double(value < 0); }

}  // namespace

double edge_smoothness(const DepthMap& depth,
                       const ColorPlanes& photograph,
                       const DepthMap& measured,
                       double weight,
                       Raster<float>& gradient) {
  if (weight == 0) return 0;
  check_sizes(photograph, photograph, nullptr);
  require(same_size(depth, photograph[0]) && same_size(depth, measured),
          "edge_smoothness: depth and photograph must have one size",
          depth.width);
  const SmoothedView view{depth, photograph, measured};
  Raster<float>& to_depth = gradient_like(depth, gradient);
  const double scale = weight / double(depth.data.size());
  const auto width = static_cast<size_t>(depth.width);
  return sum_over_rows(depth.height, [&](int y) {
    double sum = 0;
    for (int x = 0; x < depth.width; ++x) {
      const size_t i = depth.index(x, y);
      double slope = 0;
      const auto visit = [&](bool exists, size_t j, bool counts) {
        if (!exists) return;
        const double w = view.weight(i, j);
        if (w == 0) return;
        const double step = view.step(i, j);
        slope += w * sign_of(step);
        if (counts) sum += w * std::abs(step);
      };
      // Each pair counts at its second pixel, and moves both.
      visit(x > 0, i - 1, true);
      visit(y > 0, i - width, true);
      visit(x + 1 < depth.width, i + 1, false);
      visit(y + 1 < depth.height, i + width, false);
      if (slope != 0) to_depth.data[i] += float(scale * slope / double(depth.data[i]));
    }
    return scale * sum;
  });
}

}  // namespace cgs
