// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "convert/model/stage.h"

namespace cgs {

/// The stage that takes longer with more steps of the training.
inline constexpr Stage kTrainedStage = Stage::Model;

/// What a run took.
struct TimedRun {
  double pixels = 0;   ///< Of all input views.
  int steps = 0;       ///< Of the training.
  double opening = 0;  ///< [s] outside of the stages: photographs read and checked.
  /// With their times [s]; the same in all runs, but for runs of kTrainedStage alone.
  std::vector<std::pair<Stage, double>> stages;
};

/// Predicts how long a run of another size will take.
///
/// Training costs the same per pixel and step. What is left of a stage is continued from the two
/// largest runs: along a line where time grows slower than pixels (part of it is fixed), else along
/// a power of the pixels, of 1.5 at most. One size alone is scaled with the pixels.
///
/// \param runs  at least one; two of the same size with different steps tell what a step costs
/// \return [s]
double foretold_seconds(const std::vector<TimedRun>& runs, double pixels, int steps);

}  // namespace cgs
