// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/parameter_average.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace cgs::parameter_average_test {
namespace {

std::vector<ParameterBlock> one_block(size_t count) {
  std::vector<ParameterBlock> out(1);
  out[0].resize(count);
  return out;
}

TEST(ParameterAverage, IsTheWeightedMeanOfAllSteps) {
  std::vector<ParameterBlock> blocks = one_block(1);
  ParameterAverage average;
  for (const float value : {1.0f, 2.0f, 4.0f}) {
    blocks[0].value[0] = value;
    average.add(blocks, 0.75);
  }
  average.write(blocks);
  EXPECT_FLOAT_EQ(blocks[0].value[0], 0.75f * (0.75f * 1 + 0.25f * 2) + 0.25f * 4);
}

// What jumps about an optimum is nearer to it on average.
TEST(ParameterAverage, IsNearerToTheOptimumThanTheLastStep) {
  std::vector<ParameterBlock> blocks = one_block(1000);
  ParameterAverage average;
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  const auto error = [&] {
    double sum = 0;
    for (const float v : blocks[0].value) sum += std::pow(double(v) - 3, 2) / 1000;
    return std::sqrt(sum);
  };
  for (int step = 0; step < 100; ++step) {
    for (float& v : blocks[0].value) v = 3 + normal(random);
    average.add(blocks, 0.9);
  }
  const double last = error();
  average.write(blocks);
  EXPECT_LT(error(), 0.3 * last);
}

TEST(ParameterAverage, OfABlockThatBecameFreeStartsThere) {
  std::vector<ParameterBlock> blocks = one_block(0);
  ParameterAverage average;
  average.add(blocks, 0.9);
  blocks[0].value = {5, 6};
  average.add(blocks, 0.9);
  EXPECT_EQ(average.values[0], (std::vector<float>{5, 6}));
}

TEST(ParameterAverage, OfNothingLeavesTheParameters) {
  std::vector<ParameterBlock> blocks = one_block(2);
  blocks[0].value = {5, 6};
  ParameterAverage().write(blocks);
  EXPECT_EQ(blocks[0].value, (std::vector<float>{5, 6}));
}

}  // namespace
}  // namespace cgs::parameter_average_test
