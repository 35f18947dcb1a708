// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

namespace cgs {

/// A pixel whose value is known from two sources.
struct FitPoint {
  double x = 0;      ///< Given; > 0.
  double y = 0;      ///< Measured; > 0.
  double sigma = 0;  ///< Standard deviation of y.
};

/// y = scale * x + offset.
struct LineFit {
  double scale = 1;
  double offset = 0;
  double scatter = 0;  ///< Robust standard deviation of log(y / (scale x + offset)).

  double at(double x) const { return scale * x + offset; }
};

/// The line that most points agree on, by relative distance. Starts from the line through two
/// points that leaves the least median residual (Rousseeuw 1984), so that up to half of the points
/// may be anything; then iteratively reweighted least squares with Tukey's biweight, each step in
/// closed form. The same bits every time.
///
/// \return nothing where there are fewer than 50 points, where the slope would not be positive, or
///         where the line does not come near a quarter more of the points than the best constant
std::optional<LineFit> fit_line(const std::vector<FitPoint>& points);

/// The same through the origin: y = scale * x, the median of log(y / x). Nothing for fewer than 50
/// points.
std::optional<LineFit> fit_scale(const std::vector<FitPoint>& points);

}  // namespace cgs
