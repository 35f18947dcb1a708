// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/coherence/coherent_gaussians.h"

namespace cgs {

/// Running means of Adam for one block of parameters.
struct AdamState {
  std::vector<float> mean;    ///< Of the gradient.
  std::vector<float> square;  ///< Of its square.
  int64_t steps = 0;
};

/// One step of Adam with bias correction and without weight decay, beta = (0.9, 0.999); the
/// gradient is set to zero afterwards. Entries whose gradient and mean are both zero stay as they
/// are. The state is created on first use.
///
/// \param rate  length of a step where gradients agree; 0 leaves values and state alone
/// Source: Kingma and Ba 2015, "Adam", algorithm 1.
void adam_step(ParameterBlock& block, AdamState& state, float rate);

}  // namespace cgs
