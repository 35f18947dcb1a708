// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/parameter_average.h"

namespace cgs {

void ParameterAverage::add(std::span<const ParameterBlock> blocks, double decay) {
  values.resize(blocks.size());
  for (size_t b = 0; b < blocks.size(); ++b) {
    const std::vector<float>& now = blocks[b].value;
    if (values[b].size() != now.size()) {
      values[b] = now;
      continue;
    }
    for (size_t i = 0; i < now.size(); ++i) {
      const double difference = double(now[i]) - double(values[b][i]);
      values[b][i] = static_cast<float>(double(values[b][i]) + (1 - decay) * difference);
    }
  }
}

void ParameterAverage::write(std::span<ParameterBlock> blocks) const {
  for (size_t b = 0; b < values.size(); ++b) blocks[b].value = values[b];
}

}  // namespace cgs
