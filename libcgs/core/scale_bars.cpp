// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/scale_bars.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr double kSigmas = 3;

/// Metres per unit by one bar.
struct Ratio {
  double value;
  double sigma;
};

Ratio ratio_of(const ScaleBar& bar) {
  const auto is_length = [](double x) { return x > 0 && std::isfinite(x); };
  const auto is_sigma = [](double x) { return x >= 0 && std::isfinite(x); };
  require(is_length(bar.measured), "ScaleBar.measured must be > 0", bar.measured);
  require(is_length(bar.known), "ScaleBar.known must be > 0", bar.known);
  require(is_sigma(bar.measured_sigma), "ScaleBar.measured_sigma must be >= 0", bar.measured_sigma);
  require(is_sigma(bar.known_sigma), "ScaleBar.known_sigma must be >= 0", bar.known_sigma);
  constexpr double kRounding = 1e-9;  // no length is known better
  const double value = bar.known / bar.measured;
  const double relative =
      std::hypot(bar.measured_sigma / bar.measured, bar.known_sigma / bar.known, kRounding);
  return {value, value * relative};
}

bool agree(const Ratio& a, const Ratio& b) {
  return std::abs(a.value - b.value) <= kSigmas * std::hypot(a.sigma, b.sigma);
}

// Bars that most others speak for. All of them where there is no such majority: of two that
// disagree, or three that all do, nobody can tell which is wrong.
std::vector<bool> inliers(const std::vector<Ratio>& ratios) {
  std::vector<bool> out(ratios.size(), true);
  size_t outliers = 0;
  for (size_t i = 0; i < ratios.size(); ++i) {
    size_t against = 0;
    for (const Ratio& other : ratios) against += agree(ratios[i], other) ? 0 : 1;
    out[i] = against < 2 || 2 * against <= ratios.size() - 1;
    outliers += out[i] ? 0 : 1;
  }
  return 2 * outliers < ratios.size() ? out : std::vector<bool>(ratios.size(), true);
}

}  // namespace

BarScale scale_of(const std::vector<ScaleBar>& bars) {
  require(!bars.empty(), "scale_of: number of bars must be > 0", bars.size());
  std::vector<Ratio> ratios;
  ratios.reserve(bars.size());
  for (const ScaleBar& bar : bars) ratios.push_back(ratio_of(bar));

  BarScale out;
  out.used = inliers(ratios);
  double weights = 0;
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < ratios.size(); ++i) {
    if (!out.used[i]) continue;
    const double weight = 1 / (ratios[i].sigma * ratios[i].sigma);
    weights += weight;
    sum += weight * ratios[i].value;
    ++count;
  }
  out.metres_per_unit = sum / weights;
  double chi_squared = 0;
  for (size_t i = 0; i < ratios.size(); ++i) {
    out.residuals.push_back(bars[i].measured * out.metres_per_unit - bars[i].known);
    if (!out.used[i]) continue;
    const double off = (ratios[i].value - out.metres_per_unit) / ratios[i].sigma;
    chi_squared += off * off;
    out.is_consistent = out.is_consistent && std::abs(off) <= kSigmas;
  }
  const double birge = count > 1 ? std::sqrt(chi_squared / double(count - 1)) : 1;
  out.sigma = std::max(1.0, birge) / std::sqrt(weights);
  return out;
}

}  // namespace cgs
