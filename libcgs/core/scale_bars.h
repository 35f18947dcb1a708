// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace cgs {

/// A length known from elsewhere (a scale bar, a tape) and the same length in the scene.
struct ScaleBar {
  double measured = 0;        ///< In the scene [units].
  double measured_sigma = 0;  ///< Its standard deviation [units].
  double known = 0;           ///< [m]
  double known_sigma = 0;     ///< [m]
};

/// What a scene unit is, by all bars together.
struct BarScale {
  double metres_per_unit = 0;
  double sigma = 0;               ///< Standard deviation of metres_per_unit.
  std::vector<double> residuals;  ///< Per bar: measured, scaled, minus known [m].
  std::vector<bool> used;         ///< False for outliers, which do not count.
  bool is_consistent = true;      ///< The bars used agree within 3 sigma.
};

/// Weighted mean of known / measured. A bar that disagrees, by more than 3 sigma of both, with two
/// others and with most is an outlier, if a majority is left; else all are kept, as nobody can tell
/// which is wrong. Where bars scatter more than their sigmas say, the sigma of the mean grows by as
/// much (Birge ratio).
///
/// Source: Birge 1932, "The calculation of errors by the method of least squares".
/// \throws InvalidInput if there is no bar, or one has a length or sigma that none can have.
BarScale scale_of(const std::vector<ScaleBar>& bars);

}  // namespace cgs
