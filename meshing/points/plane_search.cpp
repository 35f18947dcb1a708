// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/plane_search.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

using Plane = Eigen::Hyperplane<double, 3>;

std::optional<Plane> plane_of_try(const std::vector<Eigen::Vector3f>& points, size_t number) {
  std::array<Eigen::Vector3d, 3> p;
  for (size_t k = 0; k < 3; ++k) {
    p.at(k) = points[random_number(3 * number + k) % points.size()].cast<double>();
  }
  const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
  constexpr double kOnALine = 1e-9;
  if (!(normal.norm() > kOnALine * (p[1] - p[0]).norm() * (p[2] - p[0]).norm())) return {};
  return Plane(normal.normalized(), p[0]);
}

size_t score(const std::vector<Eigen::Vector3f>& points, const Plane& plane, double distance) {
  // Enough to tell planes apart: one in a hundred of them is 3 sigma off.
  constexpr size_t kSample = 20'000;
  const size_t count = std::min(kSample, points.size());
  size_t found = 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t v = points.size() <= kSample ? i : random_number(~i) % points.size();
    found += plane.absDistance(points[v].cast<double>()) <= distance ? 1 : 0;
  }
  return found;
}

FoundPlane on_plane(const std::vector<Eigen::Vector3f>& points, const Plane& plane, double limit) {
  FoundPlane out{plane, std::vector<uint8_t>(points.size(), 0), 0, 0};
  double squares = 0;
  for (size_t v = 0; v < points.size(); ++v) {
    const double d = plane.absDistance(points[v].cast<double>());
    if (!(d <= limit)) continue;
    out.on_plane[v] = 1;
    ++out.count;
    squares += d * d;
  }
  if (out.count > 0) out.rms = std::sqrt(squares / static_cast<double>(out.count));
  return out;
}

// Least squares through the points on it.
Plane fitted(const std::vector<Eigen::Vector3f>& points, const FoundPlane& found) {
  const auto count = static_cast<double>(found.count);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (size_t v = 0; v < points.size(); ++v) {
    if (found.on_plane[v] != 0) mean += points[v].cast<double>() / count;
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (size_t v = 0; v < points.size(); ++v) {
    if (found.on_plane[v] == 0) continue;
    const Eigen::Vector3d d = points[v].cast<double>() - mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  return {Eigen::Vector3d(solver.eigenvectors().col(0)), mean};
}

}  // namespace

FoundPlane largest_plane(const std::vector<Eigen::Vector3f>& points,
                         double distance,
                         size_t tries) {
  require(distance > 0, "the distance to a plane must be > 0", distance);
  std::vector<size_t> scores(tries, 0);
  if (points.size() >= 3) {
    tbb::parallel_for(size_t(0), tries, [&](size_t i) {
      const auto plane = plane_of_try(points, i);
      if (plane) scores[i] = score(points, *plane, distance);
    });
  }
  const auto best = std::max_element(scores.begin(), scores.end());
  if (best == scores.end() || *best < 3) {
    throw NumericalError("no plane was found: three points that are not on a line are needed");
  }
  const auto plane = plane_of_try(points, static_cast<size_t>(best - scores.begin()));
  FoundPlane found = on_plane(points, *plane, distance);
  constexpr int kRounds = 20;
  for (int i = 0; i < kRounds; ++i) {
    FoundPlane next = on_plane(points, fitted(points, found), distance);
    // A few points fewer may be the better fit; half of them would be another plane.
    if (2 * next.count < found.count || next.on_plane == found.on_plane) break;
    found = std::move(next);
  }
  return found;
}

}  // namespace cgs
