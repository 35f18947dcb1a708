// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/coherence/parameter_block.h"

namespace cgs {

/// Running means of Adam for one block of parameters.
struct AdamState {
  std::vector<float> mean;    ///< Of the gradient.
  std::vector<float> square;  ///< Of its square.
  int64_t steps = 0;
};

/// What a running mean of `steps` values that began at 0 is multiplied by: 1 / (1 - decay^steps),
/// in double and without taking nearly equal numbers from each other.
/// \param decay  of the mean, in (0, 1)
/// \param steps  > 0
double bias_correction(double decay, int64_t steps);

/// One step of Adam with bias correction, beta = (0.9, 0.999); the gradient is set to zero
/// afterwards. Entries whose gradient and mean are both zero stay as they are, but for decay. The
/// state is created on first use.
///
/// A gradient that is not finite must not end a training: its entry keeps its value and its means
/// for this step. After 100 steps, one above 1000 times the root of the entry's own mean square
/// counts as 10 times that root: it moves the entry by ten rates in all, and later steps are at
/// least 0.9 times as long as without it. Before, and where there is no mean square yet, all
/// counts as it is up to 1e15, which keeps squares in range; the entry hardly moves until such
/// a mean square has faded.
/// \param rate   length of a step where gradients agree; 0 leaves values and state alone
/// \param decay  values shrink by rate times this share of themselves (AdamW)
/// \param epsilon  in the unit of the gradient: what is far below it makes no step. Gradients of a
///        mean over some 10^5 pixels are small: the usual 1e-8 would hold them back
/// \return number of entries whose gradient was not finite
/// Source: Kingma and Ba 2015, "Adam", algorithm 1; Loshchilov and Hutter 2019, "Decoupled weight
///         decay regularization", algorithm 2.
size_t adam_step(
    ParameterBlock& block, AdamState& state, float rate, float decay = 0, float epsilon = 1e-12f);

}  // namespace cgs
