// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/adam.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <tbb/parallel_for.h>

namespace cgs {

double bias_correction(double decay, int64_t steps) {
  return -1 / std::expm1(static_cast<double>(steps) * std::log(decay));
}

size_t adam_step(ParameterBlock& block, AdamState& state, float rate, float decay, float epsilon) {
  const size_t count = block.value.size();
  std::atomic<size_t> skipped = 0;
  if (rate > 0) {
    state.mean.resize(count, 0);
    state.square.resize(count, 0);
    ++state.steps;
    constexpr double kMeanDecay = 0.9;
    constexpr double kSquareDecay = 0.999;
    constexpr float kLargest = 1e15f;
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
        float& m = state.mean[i];
        float& s = state.square[i];
        if (!std::isfinite(block.gradient[i])) {
          m = s = 0;
          ++skipped_here;
          continue;
        }
        const float g = std::clamp(block.gradient[i], -kLargest, kLargest);
        m = kB1 * m + (1 - kB1) * g;
        s = kB2 * s + (1 - kB2) * g * g;
        block.value[i] *= kept;
        block.value[i] -= rate * m * unbias_mean / (std::sqrt(s * unbias_square) + epsilon);
      }
      skipped += skipped_here;
    });
  }
  std::fill(block.gradient.begin(), block.gradient.end(), 0.0f);
  return skipped;
}

}  // namespace cgs
