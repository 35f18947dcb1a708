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
    EXPECT_NEAR(values[1], usual[1], 0.011) << "one step of the length of the rate is left out";
  }
}

// Steps of an entry, each over the rate, with gradients of one size, and another one in step 2000.
std::vector<double> steps_around(float odd, float size = 1) {
  constexpr float kRate = 0x1p-7f;
  ParameterBlock block;
  block.resize(1);
  AdamState state;
  std::vector<double> out;
  for (int step = 1; step <= 2600; ++step) {
    block.value = {0};
    // The sign changes now and then, so that the running mean is smaller than its bound.
    block.gradient = {step == 2000 ? odd : step % 50 < 40 ? size : -size};
    adam_step(block, state, kRate, 0, 1e-12f * size);
    out.push_back(double(-block.value[0]) / double(kRate));
  }
  return out;
}

TEST(Adam, StepsAfterAGradientThatIsNotFiniteAreNoLongerThanTheRate) {
  for (const float odd : {std::nanf(""), INFINITY, -INFINITY}) {
    const std::vector<double> steps = steps_around(odd);
    EXPECT_EQ(steps[1999], 0);
    for (size_t k = 2000; k < steps.size(); ++k) ASSERT_LT(std::abs(steps[k]), 1.05) << k;
  }
}

TEST(Adam, AHugeGradientNeitherMovesAnEntryFarNorFreezesIt) {
  const std::vector<double> usual = steps_around(1);
  for (const float odd : {2e3f, -1e8f, 1e15f, -3e38f}) {
    const std::vector<double> steps = steps_around(odd);
    double moved = 0;
    for (size_t k = 1999; k < 2100; ++k) moved += steps[k] - usual[k];
    EXPECT_LT(std::abs(moved), 15) << odd;
    for (size_t k = 2150; k < steps.size(); ++k) {
      ASSERT_GE(std::abs(steps[k]), 0.9 * std::abs(usual[k])) << odd << ", step " << k + 1;
    }
  }
}

TEST(Adam, BoundsHugeGradientsOfAnyPowerOfTwoAlike) {
  const std::vector<double> expected = steps_around(1e6f);
  for (const int power : {-20, 20}) {
    const float size = std::ldexp(1.0f, power);
    EXPECT_EQ(steps_around(1e6f * size, size), expected) << power;
  }
}

TEST(Adam, TakesRareLargeGradientsAsTheyAre) {
  EXPECT_NE(steps_around(900), steps_around(800));
  EXPECT_EQ(steps_around(2000), steps_around(3000));
}

// A surface that comes out from behind another one.
TEST(Adam, CatchesUpWithGradientsThatRiseForGood) {
  ParameterBlock block;
  block.resize(1);
  AdamState state;
  for (int step = 1; step <= 1000; ++step) {
    block.gradient = {step <= 500 ? 1e-6f : 1.0f};
    adam_step(block, state, 0.01f, 0, 0);
  }
  EXPECT_GT(state.square[0], 0.1f);
}

TEST(Adam, TheFirstGradientMayBeHuge) {
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
