// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/adam.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace cgs {
namespace {

TEST(Adam, FollowsThePublishedAlgorithm) {
  ParameterBlock block;
  block.resize(3);
  AdamState state;
  std::vector<double> value(3, 0);
  std::vector<double> m(3, 0);
  std::vector<double> v(3, 0);
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, 1);
  for (int t = 1; t <= 50; ++t) {
    for (size_t i = 0; i < 3; ++i) {
      const float g = normal(random);
      block.gradient[i] = g;
      m[i] = 0.9 * m[i] + 0.1 * double(g);
      v[i] = 0.999 * v[i] + 0.001 * double(g) * double(g);
      const double m_hat = m[i] / (1 - std::pow(0.9, t));
      const double v_hat = v[i] / (1 - std::pow(0.999, t));
      value[i] -= 0.01 * m_hat / std::sqrt(v_hat);
    }
    adam_step(block, state, 0.01f);
  }
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(double(block.value[i]), value[i], 1e-5);
    EXPECT_EQ(block.gradient[i], 0.0f);
  }
}

TEST(Adam, StepsHaveTheLengthOfTheRateHoweverSmallTheGradient) {
  for (const float size : {1e-9f, 1.0f, 1e9f}) {
    ParameterBlock block;
    block.resize(1);
    AdamState state;
    block.gradient[0] = size;
    adam_step(block, state, 0.5f);
    EXPECT_NEAR(block.value[0], -0.5f, 1e-3f) << size;
  }
}

TEST(Adam, LeavesWhatHasNoGradient) {
  ParameterBlock block;
  block.resize(2);
  block.value = {1, 2};
  block.gradient = {0, 1};
  AdamState state;
  adam_step(block, state, 0.1f);
  EXPECT_EQ(block.value[0], 1.0f);
  EXPECT_NE(block.value[1], 2.0f);
}

TEST(Adam, RateZeroDoesNothing) {
  ParameterBlock block;
  block.resize(1);
  block.gradient = {1};
  AdamState state;
  adam_step(block, state, 0);
  EXPECT_EQ(block.value[0], 0.0f);
  EXPECT_EQ(state.steps, 0);
  EXPECT_TRUE(state.mean.empty());
}

}  // namespace
}  // namespace cgs
