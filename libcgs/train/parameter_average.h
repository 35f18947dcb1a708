// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "libcgs/coherence/parameter_block.h"

namespace cgs {

/// Running mean of parameters over the steps of a training: the mean of values that jump about an
/// optimum is nearer to it than the last of them.
///
/// Source: Polyak and Juditsky 1992, "Acceleration of stochastic approximation by averaging"; as
///         the one-model form of Zhao et al. 2025, "Self-Ensembling Gaussian Splatting".
struct ParameterAverage {
  /// One set of values per block; empty before the first step.
  std::vector<std::vector<float>> values;

  /// Moves the mean by the share 1 - decay to the parameters as they are. A block whose size
  /// changed (shapes that became free) starts anew.
  void add(std::span<const ParameterBlock> blocks, double decay);

  /// Puts the mean in the place of the parameters; without one they stay.
  void write(std::span<ParameterBlock> blocks) const;
};

}  // namespace cgs
