// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/adam.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace cgs {

void adam_step(ParameterBlock& block, AdamState& state, float rate) {
  const size_t count = block.value.size();
  if (rate > 0) {
    state.mean.resize(count, 0);
    state.square.resize(count, 0);
    ++state.steps;
    constexpr double kMeanDecay = 0.9;
    constexpr double kSquareDecay = 0.999;
    // Gradients of a mean over some 10^5 pixels are small: the usual 1e-8 would hold them back.
    constexpr float kTiny = 1e-12f;
    const auto steps = static_cast<double>(state.steps);
    const auto unbias_mean = static_cast<float>(1 / (1 - std::pow(kMeanDecay, steps)));
    const auto unbias_square = static_cast<float>(1 / (1 - std::pow(kSquareDecay, steps)));
    constexpr auto kB1 = static_cast<float>(kMeanDecay);
    constexpr auto kB2 = static_cast<float>(kSquareDecay);
    constexpr size_t kBlock = 1 << 15;
    tbb::parallel_for(size_t{0}, (count + kBlock - 1) / kBlock, [&](size_t b) {
      const size_t end = std::min(count, (b + 1) * kBlock);
      for (size_t i = b * kBlock; i < end; ++i) {
        const float g = block.gradient[i];
        float& m = state.mean[i];
        float& s = state.square[i];
        m = kB1 * m + (1 - kB1) * g;
        s = kB2 * s + (1 - kB2) * g * g;
        block.value[i] -= rate * m * unbias_mean / (std::sqrt(s * unbias_square) + kTiny);
      }
    });
  }
  std::fill(block.gradient.begin(), block.gradient.end(), 0.0f);
}

}  // namespace cgs
