// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

double emptiness(const TrainingBuffers& rendered, double weight, TrainingBuffers& gradient) {
  const Raster<float>& alpha = rendered.alpha;
  if (weight == 0) return 0;
  require(!alpha.empty() && same_size(alpha, rendered.weight_square_sum),
          "emptiness: alpha and squared weights must have one size",
          rendered.weight_square_sum.width);
  Raster<float>& to_alpha = gradient_like(alpha, gradient.alpha);
  Raster<float>& to_squares = gradient_like(alpha, gradient.weight_square_sum);
  const double scale = weight / double(alpha.data.size());
  return sum_over_rows(alpha.height, [&](int y) {
    double sum = 0;
    const size_t begin = alpha.index(0, y);
    for (size_t i = begin; i < begin + alpha.width; ++i) {
      sum += double(alpha.data[i]) - double(rendered.weight_square_sum.data[i]);
      to_alpha.data[i] += float(scale);
      to_squares.data[i] -= float(scale);
    }
    return scale * sum;
  });
}

}  // namespace cgs
