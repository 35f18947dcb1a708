// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/time_model.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::time_model_test {
namespace {

// A machine whose costs are known: a sweep with a power of 1.25, training, a mesh with a fixed
// part, photographs decoded in any case.
TimedRun run_of(double pixels, int steps) {
  TimedRun out;
  out.pixels = pixels;
  out.steps = steps;
  out.opening = 0.7;
  out.stages = {{Stage::Model, 2e-6 * std::pow(pixels, 1.25) + 3e-7 * pixels * steps},
                {Stage::Mesh, 0.4 + 2e-5 * pixels}};
  return out;
}

double total(const TimedRun& run) {
  double sum = run.opening;
  for (const auto& [stage, seconds] : run.stages) sum += seconds;
  return sum;
}

TEST(TimeModel, LearnsWhatAStepCostsFromTrainingAlone) {
  TimedRun training = run_of(4e4, 20);
  training.stages.pop_back();
  training.opening = 0;
  const std::vector<TimedRun> runs = {training, run_of(4e4, 5), run_of(1.6e5, 5)};
  const double truth = total(run_of(6.4e5, 60));
  EXPECT_NEAR(foretold_seconds(runs, 6.4e5, 60), truth, 1e-6 * truth);
}

TEST(TimeModel, ContinuesFixedCostsPowersAndSteps) {
  const std::vector<TimedRun> runs = {run_of(4e4, 5), run_of(4e4, 20), run_of(1.6e5, 5)};
  for (const double pixels : {4e4, 1.6e5, 6.4e5, 2.5e6}) {
    for (const int steps : {0, 20, 60}) {
      const double truth = total(run_of(pixels, steps));
      EXPECT_NEAR(foretold_seconds(runs, pixels, steps), truth, 1e-6 * truth);
    }
  }
}

TEST(TimeModel, ScalesOneSizeWithThePixels) {
  const std::vector<TimedRun> runs = {run_of(4e4, 20)};
  const TimedRun& only = runs.front();
  EXPECT_NEAR(foretold_seconds(runs, 8e4, 20), 2 * (total(only) - only.opening) + 0.7, 1e-9);
}

TEST(TimeModel, NoiseMakesNothingNegativeOrWild) {
  TimedRun slow = run_of(4e4, 5);
  slow.stages = {{Stage::Model, 3}, {Stage::Mesh, 5}};
  TimedRun quick = run_of(4e4, 20);
  quick.stages = {{Stage::Model, 2}, {Stage::Mesh, 1e-9}};
  TimedRun larger = run_of(1.6e5, 5);
  larger.stages = {{Stage::Model, 1}, {Stage::Mesh, 90}};
  const double seconds = foretold_seconds({slow, quick, larger}, 6.4e5, 60);
  EXPECT_GT(seconds, 90);
  EXPECT_LE(seconds, 0.7 + 2 + 90 * std::pow(4, 1.5));  // no power above 1.5
}

TEST(TimeModel, RefusesNothingToJudgeBy) {
  EXPECT_THROW(foretold_seconds({}, 100, 1), InvalidInput);
}

}  // namespace
}  // namespace cgs::time_model_test
