// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/adam.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace cgs::adam_test {
namespace {

void expect_published_algorithm(float decay) {
  ParameterBlock block;
  block.resize(3);
  block.value = {2, 2, 2};
  AdamState state;
  std::vector<double> value(3, 2);
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
      value[i] -= 0.01 * double(decay) * value[i] + 0.01 * m_hat / std::sqrt(v_hat);
    }
    adam_step(block, state, 0.01f, decay);
  }
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(double(block.value[i]), value[i], 1e-5);
    EXPECT_EQ(block.gradient[i], 0.0f);
  }
}

TEST(Adam, FollowsThePublishedAlgorithm) { expect_published_algorithm(0); }

TEST(Adam, DecaysWeightsApartFromTheGradient) { expect_published_algorithm(0.5f); }

TEST(Adam, CorrectsTheBiasOfTheFirstStepsToTheLastDigits) {
  for (const double decay : {0.9, 0.999}) {
    long double power = 1;
    for (int64_t t = 1; t <= 100'000; ++t) {
      power *= static_cast<long double>(decay);
      const double expected = static_cast<double>(1 / (1 - power));
      ASSERT_NEAR(bias_correction(decay, t) / expected, 1, 1e-12) << decay << ", step " << t;
    }
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

TEST(Adam, SkipsWhatIsNotFiniteAndOnlyThat) {
  const auto values_after = [](float odd, size_t* skipped) {
    ParameterBlock block;
    block.resize(3);
    AdamState state;
    *skipped = 0;
    for (int step = 0; step < 20; ++step) {
      block.gradient = {0.5f, step == 10 ? odd : 0.25f, -2};
      *skipped += adam_step(block, state, 0.01f);
    }
    return block.value;
  };
  size_t none = 0;
  const std::vector<float> usual = values_after(0.25f, &none);
  EXPECT_EQ(none, 0u);
  for (const float odd : {std::nanf(""), INFINITY, -INFINITY}) {
    size_t skipped = 0;
    const std::vector<float> values = values_after(odd, &skipped);
    EXPECT_EQ(skipped, 1u);
    EXPECT_EQ(values[0], usual[0]);
    EXPECT_EQ(values[2], usual[2]);
    // Its steps grow to the length of the rate again, as they did in the beginning.
    EXPECT_NEAR(values[1], usual[1], 0.03);
  }
}

TEST(Adam, AHugeGradientDoesNotFreezeAnEntry) {
  ParameterBlock block;
  block.resize(1);
  AdamState state;
  block.gradient = {3e38f};
  adam_step(block, state, 0.01f);
  EXPECT_NEAR(block.value[0], -0.01f, 1e-4f);
  EXPECT_TRUE(std::isfinite(state.square[0]));
}

TEST(Adam, TakesTheSameStepsForGradientsOfAnyPowerOfTwo) {
  const auto values_after = [](int power, float epsilon) {
    ParameterBlock block;
    block.resize(1);
    AdamState state;
    for (int step = 0; step < 20; ++step) {
      block.gradient = {std::ldexp(1.0f + 0.1f * float(step % 3), power)};
      adam_step(block, state, 0.01f, 0, epsilon);
    }
    return block.value[0];
  };
  for (const int power : {-20, -10, 10, 20}) {
    // To the bit if epsilon is scaled along; as it is, what is left of it is far below a step.
    EXPECT_EQ(values_after(power, std::ldexp(1e-3f, power)), values_after(0, 1e-3f)) << power;
    EXPECT_NEAR(values_after(power, 1e-12f), values_after(0, 1e-12f), 1e-6f) << power;
  }
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
}  // namespace cgs::adam_test
