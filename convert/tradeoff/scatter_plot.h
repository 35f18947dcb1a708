// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace cgs {

/// Points that trade one thing for another, the best of them joined.
struct ScatterPlot {
  struct Point {
    double x = 0;
    double y = 0;
    std::string label;
    bool on_front = false;  ///< Joined to the others on it by stairs, in the order of x.
  };

  std::string title;
  std::string x_axis;  ///< With unit.
  std::string y_axis;
  bool y_is_logarithmic = false;  ///< x always is; then values must be > 0.
  std::vector<Point> points;
};

/// Several plots below each other as one SVG that needs nothing else and follows the reader's
/// choice of a dark or light screen. Plots without points say so.
std::string scatter_svg(const std::vector<ScatterPlot>& plots);

}  // namespace cgs
