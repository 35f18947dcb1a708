// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace cgs {

// All but median_of() and quantile_of_sorted() leave the values in another order. There must be
// one, and no NaN among them.

/// The value that k others precede in ascending order; k < values.size().
template <typename T>
T nth_smallest(std::vector<T>& values, size_t k) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(k);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The middle value; of an even number of them the larger one of the two.
template <typename T>
T median(std::vector<T>& values) {
  return nth_smallest(values, values.size() / 2);
}

/// The value at the share q of the way through the order, rounded down; 0 <= q <= 1.
template <typename T>
T quantile(std::vector<T>& values, double q) {
  return nth_smallest(values, static_cast<size_t>(q * static_cast<double>(values.size() - 1)));
}

/// The same of values that are in ascending order.
template <typename T>
T quantile_of_sorted(const std::vector<T>& values, double q) {
  return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
}

/// The middle value; of an even number of them the smaller one of the two.
inline double median_of(std::vector<double> values) {
  return nth_smallest(values, (values.size() - 1) / 2);
}

/// 1.4826 times the median distance from the median: the standard deviation, if normal. 0 for none.
inline double robust_deviation(std::vector<double> values) {
  constexpr double kNormal = 1.4826;
  if (values.empty()) return 0;
  const double median = median_of(values);
  for (double& value : values) value = std::abs(value - median);
  return kNormal * median_of(std::move(values));
}

}  // namespace cgs
