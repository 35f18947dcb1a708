// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/e2e/extremes/cell.h"
#include "tests/support/largest.h"

namespace cgs::test {

using Points = std::vector<Eigen::Vector3d>;

/// Largest distance between points in the world of a cell and plain points, in plain units.
inline double largest_error(const Points& in_world, const Points& plain, const Cell& cell) {
  if (in_world.size() != plain.size() || plain.empty()) return NAN;
  double out = 0;
  for (size_t i = 0; i < plain.size(); ++i) {
    out = largest(out, (cell.plain(in_world[i]) - plain[i]).norm());
  }
  return out;
}

inline double nearest_distance(const Eigen::Vector3d& p, const Points& points) {
  double best = INFINITY;
  for (const Eigen::Vector3d& q : points) best = std::min(best, (p - q).squaredNorm());
  return std::sqrt(best);
}

/// Share of points that have no point of the other set within `tolerance`, the worse way round.
inline double share_apart(const Points& a, const Points& b, double tolerance) {
  const auto one_way = [&](const Points& from, const Points& to) {
    size_t apart = 0;
    for (const auto& p : from) apart += nearest_distance(p, to) > tolerance ? 1 : 0;
    return from.empty() ? 1.0 : double(apart) / double(from.size());
  };
  return std::max(one_way(a, b), one_way(b, a));
}

inline Points plain_points(const Points& in_world, const Cell& cell) {
  Points out;
  for (const auto& p : in_world) out.push_back(cell.plain(p));
  return out;
}

inline double distance_to_triangle(const Eigen::Vector3d& p,
                                   const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const bool inside = normal.squaredNorm() > 0 && (b - a).cross(p - a).dot(normal) >= 0 &&
                      (c - b).cross(p - b).dot(normal) >= 0 &&
                      (a - c).cross(p - c).dot(normal) >= 0;
  if (inside) return std::abs((p - a).dot(normal.normalized()));
  const auto to_segment = [&](const Eigen::Vector3d& s, const Eigen::Vector3d& e) {
    const Eigen::Vector3d d = e - s;
    const double t = d.squaredNorm() > 0 ? (p - s).dot(d) / d.squaredNorm() : 0;
    return (p - s - std::clamp(t, 0.0, 1.0) * d).norm();
  };
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

}  // namespace cgs::test
