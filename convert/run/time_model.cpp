// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/time_model.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr double kSteepest = 1.5;  // planes of a sweep grow with the side of a picture

bool has_stage(const TimedRun& run, Stage stage) {
  return std::any_of(
      run.stages.begin(), run.stages.end(), [&](const auto& s) { return s.first == stage; });
}

double seconds_of(const TimedRun& run, Stage stage) {
  const auto found = std::find_if(
      run.stages.begin(), run.stages.end(), [&](const auto& s) { return s.first == stage; });
  return found == run.stages.end() ? 0 : found->second;
}

// Seconds per pixel and step; 0 where no two runs tell it.
double step_cost(const std::vector<TimedRun>& runs) {
  for (const TimedRun& a : runs) {
    for (const TimedRun& b : runs) {
      if (a.pixels != b.pixels || a.steps >= b.steps) continue;
      const double difference = seconds_of(b, kTrainedStage) - seconds_of(a, kTrainedStage);
      return std::max(0.0, difference / (a.pixels * (b.steps - a.steps)));
    }
  }
  return 0;
}

// By the number of pixels, what a stage takes [s].
double continued(const std::map<double, double>& measured, double pixels) {
  const auto [p2, t2] = *measured.rbegin();
  if (measured.size() < 2) return t2 * pixels / p2;
  const auto [p1, t1] = *std::next(measured.rbegin());
  if (t2 <= 0 || t1 <= 0) return std::max(t2, 0.0) * pixels / p2;
  const double power = std::log(t2 / t1) / std::log(p2 / p1);
  if (power > 1) return t2 * std::pow(pixels / p2, std::min(power, kSteepest));
  const double slope = std::max(0.0, (t2 - t1) / (p2 - p1));
  return std::max(0.0, t2 + slope * (pixels - p2));
}

}  // namespace

double foretold_seconds(const std::vector<TimedRun>& runs, double pixels, int steps) {
  require(!runs.empty() && pixels > 0, "a run to judge by and a size must be given", runs.size());
  const double per_step = step_cost(runs);
  double total = per_step * pixels * steps;
  for (const auto& [stage, seconds] : runs.back().stages) {
    std::map<double, double> measured;
    for (const TimedRun& run : runs) {
      if (!has_stage(run, stage)) continue;
      const double training = stage == kTrainedStage ? per_step * run.pixels * run.steps : 0;
      measured[run.pixels] = std::max(0.0, seconds_of(run, stage) - training);
    }
    total += continued(measured, pixels);
  }
  double opening = 0;
  for (const TimedRun& run : runs) opening = std::max(opening, run.opening);
  return total + opening;
}

}  // namespace cgs
