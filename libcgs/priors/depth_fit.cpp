// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "libcgs/core/order_statistics.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

constexpr size_t kFewestOfAFit = 50;
constexpr double kNormal = 1.4826;  // median distance to standard deviation

double off(const LineFit& line, const FitPoint& p) {
  const double value = line.at(p.x);
  return value > 0 ? std::abs(std::log(p.y / value)) : std::numeric_limits<double>::infinity();
}

double median_off(const LineFit& line, const std::vector<FitPoint>& points) {
  std::vector<double> all(points.size());
  std::transform(
      points.begin(), points.end(), all.begin(), [&](const FitPoint& p) { return off(line, p); });
  return median_of(std::move(all));
}

// Number of points within a relative distance.
size_t count_near(const LineFit& line, const std::vector<FitPoint>& points, double distance) {
  return static_cast<size_t>(std::count_if(
      points.begin(), points.end(), [&](const FitPoint& p) { return off(line, p) < distance; }));
}

// The same for the best constant, which does not look at the given values.
size_t count_near_constant(const std::vector<FitPoint>& points, double distance) {
  constexpr size_t kCandidates = 200;
  const size_t step = std::max(size_t{1}, points.size() / kCandidates);
  size_t best = 0;
  for (size_t i = 0; i < points.size(); i += step) {
    best = std::max(best, count_near({0, points[i].y, 0}, points, distance));
  }
  return best;
}

// Through two points; of many pairs, the line with the least median residual.
LineFit least_median_line(const std::vector<FitPoint>& points) {
  constexpr size_t kJudges = 1000;
  constexpr uint64_t kPairs = 400;
  std::vector<FitPoint> judges;
  const size_t step = std::max(size_t{1}, points.size() / kJudges);
  for (size_t i = 0; i < points.size(); i += step) judges.push_back(points[i]);
  LineFit best{0, 0, std::numeric_limits<double>::infinity()};
  for (uint64_t k = 0; k < kPairs; ++k) {
    const FitPoint& a = points[split_mix(2 * k + 1) % points.size()];
    const FitPoint& b = points[split_mix(2 * k + 2) % points.size()];
    if (a.x == b.x) continue;
    LineFit line;
    line.scale = (b.y - a.y) / (b.x - a.x);
    line.offset = a.y - line.scale * a.x;
    if (!(line.scale > 0)) continue;
    line.scatter = kNormal * median_off(line, judges);
    if (line.scatter < best.scatter) best = line;
  }
  return best;
}

// One step of weighted least squares; weights fall to 0 at 4.685 deviations (Tukey's biweight).
bool reweighted(const std::vector<FitPoint>& points, LineFit& line) {
  constexpr double kReach = 4.685;
  double w = 0;
  double wx = 0;
  double wy = 0;
  double wxx = 0;
  double wxy = 0;
  for (const FitPoint& p : points) {
    const double deviation = std::hypot(line.scatter * p.y, p.sigma);
    const double r = (p.y - line.at(p.x)) / (kReach * deviation);
    if (!(std::abs(r) < 1)) continue;
    const double weight = std::pow((1 - r * r) / deviation, 2);
    w += weight;
    wx += weight * p.x;
    wy += weight * p.y;
    wxx += weight * p.x * p.x;
    wxy += weight * p.x * p.y;
  }
  const double spread = w * wxx - wx * wx;
  if (!(spread > 1e-12 * w * wxx)) return false;
  line.scale = (w * wxy - wx * wy) / spread;
  line.offset = (wy - line.scale * wx) / w;
  // What two sources share exactly still has rounding.
  constexpr double kLeast = 1e-6;
  line.scatter = std::max(kLeast, kNormal * median_off(line, points));
  return line.scale > 0 && std::isfinite(line.scatter);
}

}  // namespace

std::optional<LineFit> fit_line(const std::vector<FitPoint>& points) {
  if (points.size() < kFewestOfAFit) return std::nullopt;
  LineFit line = least_median_line(points);
  if (!std::isfinite(line.scatter)) return std::nullopt;
  line.scatter = std::max(line.scatter, 1e-6);
  constexpr int kRounds = 20;
  for (int i = 0; i < kRounds; ++i) {
    if (!reweighted(points, line)) return std::nullopt;
  }
  constexpr double kDeviations = 3;
  constexpr double kGain = 1.25;
  const double near = kDeviations * line.scatter;
  const bool tells = static_cast<double>(count_near(line, points, near)) >
                     kGain * static_cast<double>(count_near_constant(points, near));
  return tells ? std::optional(line) : std::nullopt;
}

std::optional<LineFit> fit_scale(const std::vector<FitPoint>& points) {
  if (points.size() < kFewestOfAFit) return std::nullopt;
  std::vector<double> logs(points.size());
  std::transform(points.begin(), points.end(), logs.begin(), [](const FitPoint& p) {
    return std::log(p.y / p.x);
  });
  LineFit line;
  line.scale = std::exp(median_of(logs));
  line.scatter = robust_deviation(std::move(logs));
  return line;
}

}  // namespace cgs
