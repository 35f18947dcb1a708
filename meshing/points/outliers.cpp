// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/points/outliers.h"

#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"

namespace cgs {

namespace {

constexpr size_t kPointsAtOnce = 1024;

// Per point, the mean distance to so many other points.
std::vector<double> mean_distances(const std::vector<Eigen::Vector3f>& points, size_t neighbors) {
  const KdTree tree(points);
  std::vector<double> out(points.size(), 0);
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, points.size(), kPointsAtOnce), [&](const auto& range) {
        std::vector<Neighbor> found;
        for (size_t i = range.begin(); i != range.end(); ++i) {
          const uint32_t point = tree.order()[i];
          tree.nearest(points[point], neighbors + 1, found);  // the point itself is among them
          double sum = 0;
          for (const Neighbor& n : found) sum += std::sqrt(double(n.squared_distance));
          if (found.size() > 1) out[point] = sum / static_cast<double>(found.size() - 1);
        }
      });
  return out;
}

}  // namespace

std::vector<uint8_t> without_statistical_outliers(const std::vector<Eigen::Vector3f>& points,
                                                  size_t neighbors,
                                                  double deviations) {
  require(neighbors > 0, "the number of neighbours must be > 0", neighbors);
  require(deviations >= 0, "the number of standard deviations must be >= 0", deviations);
  std::vector<uint8_t> keep(points.size(), 1);
  if (points.size() < 2) return keep;
  const std::vector<double> distances = mean_distances(points, neighbors);
  double sum = 0;
  for (const double d : distances) sum += d;
  const double mean = sum / static_cast<double>(points.size());
  double squares = 0;
  for (const double d : distances) squares += (d - mean) * (d - mean);
  const double deviation = std::sqrt(squares / static_cast<double>(points.size() - 1));
  for (size_t i = 0; i < keep.size(); ++i) {
    keep[i] = distances[i] <= mean + deviations * deviation ? 1 : 0;
  }
  return keep;
}

std::vector<uint8_t> without_lonely_points(const std::vector<Eigen::Vector3f>& points,
                                           size_t neighbors,
                                           double radius) {
  require(neighbors > 0, "the number of neighbours must be > 0", neighbors);
  require(radius > 0, "the radius must be > 0", radius);
  const KdTree tree(points);
  std::vector<uint8_t> keep(points.size(), 0);
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, points.size(), kPointsAtOnce), [&](const auto& range) {
        for (size_t i = range.begin(); i != range.end(); ++i) {
          const uint32_t point = tree.order()[i];
          const size_t found = tree.count_within(points[point], float(radius), neighbors + 1);
          keep[point] = found > neighbors ? 1 : 0;
        }
      });
  return keep;
}

}  // namespace cgs
