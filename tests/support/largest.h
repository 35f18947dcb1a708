// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace cgs::test {

/// The larger of two numbers, NaN if one of them is: std::max() would keep the first, and no bound
/// would notice.
inline double largest(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return std::numeric_limits<double>::quiet_NaN();
  return std::max(a, b);
}

}  // namespace cgs::test
