// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/pull_push.h"

#include <array>
#include <cstddef>
#include <random>

#include <gtest/gtest.h>

namespace cgs::pull_push_test {
namespace {

void know(PulledLevel& level, int x, int y, const Eigen::Vector3f& color, float depth = 1) {
  level.color(x, y) = color;
  level.depth(x, y) = depth;
  level.weight(x, y) = 1;
}

Eigen::Vector3f grey(float value) { return Eigen::Vector3f::Constant(value); }

TEST(PulledAndPushed, RunsFromOneEndToTheOther) {
  PulledLevel level(4, 1);
  know(level, 0, 0, grey(0));
  know(level, 3, 0, grey(1));
  const PulledLevel out = pulled_and_pushed(level, 0);
  constexpr std::array<float, 4> kExpected = {0, 0.25f, 0.75f, 1};
  for (int x = 0; x < 4; ++x) {
    EXPECT_EQ(out.color(x, 0), grey(kExpected.at(size_t(x)))) << x;
    EXPECT_EQ(out.depth(x, 0), 1) << x;
    EXPECT_EQ(out.weight(x, 0), 1) << x;
  }
}

// At half the depth a colour counts a 256th.
TEST(PulledAndPushed, LetsTheFarSideGoOnInNarrowGaps) {
  PulledLevel level(4, 1);
  know(level, 0, 0, grey(0), 1);
  know(level, 3, 0, grey(1), 2);
  const PulledLevel out = pulled_and_pushed(level, 1);
  EXPECT_NEAR(out.color(1, 0).x(), 0.25f / (0.25f + 0.75f / 256), 1e-6f);
  EXPECT_NEAR(out.color(2, 0).x(), 0.75f / (0.75f + 0.25f / 256), 1e-6f);
}

TEST(PulledAndPushed, FillsEverythingWithTheOnePixelThatIsKnown) {
  const Eigen::Vector3f color(0.25f, 0.5f, 1);
  for (const size_t narrow : {0, 1, 5}) {
    PulledLevel level(5, 3);
    know(level, 3, 1, color, 2);
    const PulledLevel out = pulled_and_pushed(level, narrow);
    for (size_t i = 0; i < out.color.data.size(); ++i) {
      EXPECT_EQ(out.color.data[i], color) << i;
      EXPECT_EQ(out.depth.data[i], 2) << i;
      EXPECT_EQ(out.weight.data[i], 1) << i;
    }
  }
}

TEST(PulledAndPushed, KnowsNothingWhereNothingIsKnown) {
  const PulledLevel out = pulled_and_pushed(PulledLevel(7, 4), 2);
  ASSERT_EQ(out.weight.data.size(), 28u);
  for (const float weight : out.weight.data) EXPECT_EQ(weight, 0);
}

// No direction is another than the others, where all sizes are even.
TEST(PulledAndPushed, OfAMirroredPictureIsMirrored) {
  constexpr int kSize = 8;
  for (const size_t narrow : {0, 2}) {
    PulledLevel level(kSize, kSize);
    PulledLevel mirrored(kSize, kSize);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    int known = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const Eigen::Vector3f color(uniform(random), uniform(random), uniform(random));
        const float depth = 1 + uniform(random);
        if (uniform(random) > 0.3f) continue;
        know(level, x, y, color, depth);
        know(mirrored, kSize - 1 - x, kSize - 1 - y, color, depth);
        ++known;
      }
    }
    ASSERT_GT(known, 5);
    const PulledLevel out = pulled_and_pushed(level, narrow);
    const PulledLevel other = pulled_and_pushed(mirrored, narrow);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const int u = kSize - 1 - x;
        const int v = kSize - 1 - y;
        EXPECT_LT((out.color(x, y) - other.color(u, v)).norm(), 1e-5f) << x << ' ' << y;
        EXPECT_NEAR(out.depth(x, y), other.depth(u, v), 1e-5f) << x << ' ' << y;
        EXPECT_EQ(out.weight(x, y), other.weight(u, v)) << x << ' ' << y;
      }
    }
  }
}

}  // namespace
}  // namespace cgs::pull_push_test
