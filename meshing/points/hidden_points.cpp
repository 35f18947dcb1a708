// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/hidden_points.h"

#include <algorithm>

#include "libcgs/core/error.h"
#include "meshing/edit/hull.h"
#include "meshing/mesh/stated_surface.h"

namespace cgs {

namespace {

// Of the sphere, for points no farther away than `farthest`. On a wall at that distance a point
// between its neighbours is hidden if it lies farther behind them than
// radius * (spacing / farthest)^2 / 4.
double radius_for(double spacing, double farthest) {
  constexpr double kMost = 1e5;  // beyond that doubles hold too little of what lies behind
  return farthest * std::clamp(2 * farthest / std::max(spacing, 1e-30), 2.0, kMost);
}

}  // namespace

std::vector<uint8_t> seen_from(const std::vector<Eigen::Vector3f>& points,
                               const Eigen::Vector3d& eye) {
  require(points.size() >= 4,
          "the number of points to find hidden ones among must be >= 4",
          points.size());
  double farthest = 0;
  for (const auto& p : points) farthest = std::max(farthest, (p.cast<double>() - eye).norm());
  const double radius = radius_for(point_spacing(points), farthest);
  std::vector<Eigen::Vector3d> mirrored;
  mirrored.reserve(points.size() + 1);
  for (const auto& p : points) {
    const Eigen::Vector3d way = p.cast<double>() - eye;
    const double distance = way.norm();
    if (distance > 0) mirrored.emplace_back((2 * radius / distance - 1) * way);
    if (distance == 0) mirrored.emplace_back(way);
  }
  mirrored.emplace_back(0, 0, 0);  // the eye
  std::vector<uint8_t> out = on_convex_hull(mirrored);
  out.pop_back();
  for (size_t v = 0; v < out.size(); ++v) {
    if (points[v].cast<double>() == eye) out[v] = 1;
  }
  return out;
}

}  // namespace cgs
