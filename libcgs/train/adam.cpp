// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/adam.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

namespace cgs {

namespace {

// A gradient and what it counts as. The means of the first steps say little: those of an entry that
// few of the first pictures show are small, and what it gets from the next one is no outlier.
float bounded(float gradient, float mean_square, float epsilon, int64_t steps) {
  constexpr int64_t kFewestSteps = 100;
  constexpr float kOutlier = 1000;   // times the root of the mean square
  constexpr float kCountsAs = 10;    // the same; what rises for good is caught up with in time
  constexpr float kLargest = 1e15f;  // keeps squares in range
  const float outlier = kOutlier * kOutlier * (mean_square + epsilon * epsilon);
  if (steps > kFewestSteps && mean_square > 0 && gradient * gradient > outlier) {
    return std::copysign(kCountsAs * std::sqrt(mean_square), gradient);
  }
  return std::clamp(gradient, -kLargest, kLargest);
}

}  // namespace

double bias_correction(double decay, int64_t steps) {
  return -1 / std::expm1(static_cast<double>(steps) * std::log(decay));
}

size_t adam_step(ParameterBlock& block, AdamState& state, float rate, float decay, float epsilon) {
  if (!(rate > 0)) {
    std::fill(block.gradient.begin(), block.gradient.end(), 0.0f);
    return 0;
  }
  const size_t count = block.value.size();
  std::atomic<size_t> skipped = 0;
  state.mean.resize(count, 0);
  state.square.resize(count, 0);
  ++state.steps;
  constexpr double kMeanDecay = 0.9;
  constexpr double kSquareDecay = 0.999;
  const auto unbias_mean = static_cast<float>(bias_correction(kMeanDecay, state.steps));
  const auto unbias_square = static_cast<float>(bias_correction(kSquareDecay, state.steps));
  constexpr auto kB1 = static_cast<float>(kMeanDecay);
  constexpr auto kB2 = static_cast<float>(kSquareDecay);
  const float kept = 1 - rate * decay;
  constexpr size_t kBlock = 1 << 15;
  tbb::parallel_for(size_t{0}, (count + kBlock - 1) / kBlock, [&](size_t b) {
    const size_t end = std::min(count, (b + 1) * kBlock);
    size_t skipped_here = 0;
    for (size_t i = b * kBlock; i < end; ++i) {
      const float gradient = std::exchange(block.gradient[i], 0.0f);
      if (!std::isfinite(gradient)) {
        // Its means stay, too: begun anew, they would be corrected as those of all other steps,
        // and its next steps would be several times too long.
        ++skipped_here;
        continue;
      }
      float& m = state.mean[i];
      float& s = state.square[i];
      const float g = bounded(gradient, s * unbias_square, epsilon, state.steps);
      m = kB1 * m + (1 - kB1) * g;
      s = kB2 * s + (1 - kB2) * g * g;
      block.value[i] *= kept;
      block.value[i] -= rate * m * unbias_mean / (std::sqrt(s * unbias_square) + epsilon);
    }
    skipped += skipped_here;
  });
  return skipped;
}

}  // namespace cgs
