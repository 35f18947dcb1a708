// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

double depth_spread(const TrainingBuffers& rendered,
                    const DepthMap& measured,
                    const DepthMap& sigma,
                    double weight,
                    TrainingBuffers& gradient) {
  const Raster<float>& alpha = rendered.alpha;
  if (weight == 0) return 0;
  require(!alpha.empty() && same_size(alpha, rendered.depth_sum) &&
              same_size(alpha, rendered.depth_square_sum) && same_size(alpha, measured) &&
              same_size(alpha, sigma),
          "depth_spread: alpha, depth and what was measured must have one size",
          measured.width);
  Raster<float>& to_alpha = gradient_like(alpha, gradient.alpha);
  Raster<float>& to_depth = gradient_like(alpha, gradient.depth_sum);
  Raster<float>& to_square = gradient_like(alpha, gradient.depth_square_sum);
  const double scale = weight / double(alpha.data.size());
  return sum_over_rows(alpha.height, [&](int y) {
    double sum = 0;
    const size_t begin = alpha.index(0, y);
    for (size_t i = begin; i < begin + alpha.width; ++i) {
      const auto z = double(measured.data[i]);
      const double precision = 1 / (double(sigma.data[i]) * double(sigma.data[i]));
      if (!std::isfinite(z) || !std::isfinite(precision)) continue;
      const auto a = double(alpha.data[i]);
      // Rounding of the sums can leave less than nothing.
      const double apart = double(rendered.depth_square_sum.data[i]) -
                           2 * z * double(rendered.depth_sum.data[i]) + z * z * a;
      const double root = std::sqrt(1 + precision * std::max(apart, 0.0) + std::max(1 - a, 0.0));
      sum += scale * (root - 1);
      const double slope = 0.5 * scale / root;
      const double of_apart = apart > 0 ? slope * precision : 0;
      to_square.data[i] += float(of_apart);
      to_depth.data[i] -= float(2 * z * of_apart);
      to_alpha.data[i] += float(z * z * of_apart - (a < 1 ? slope : 0));
    }
    return sum;
  });
}

}  // namespace cgs
