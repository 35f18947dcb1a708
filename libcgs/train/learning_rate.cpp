// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/learning_rate.h"

#include <cmath>

namespace cgs {

double triangular2(double step, double base, double peak, double half_period) {
  const double cycle = std::floor(step / (2 * half_period));
  const double from_peak = std::abs(step / half_period - 2 * cycle - 1);
  return base + (peak - base) * (1 - from_peak) / std::exp2(cycle);
}

}  // namespace cgs
