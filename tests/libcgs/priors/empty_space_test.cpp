// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/empty_space.h"

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"
#include "tests/support/unmeasured_priors.h"

namespace cgs::empty_space_test {
namespace {

constexpr int kSide = 40;

// A witness a unit to the right of a camera, both looking along +z, that measured a wall at 4.
class EmptySpaceTest : public testing::Test {
 protected:
  EmptySpaceTest() : priors_(test::unmeasured_priors(kSide, kSide)) {
    camera_ = test::looking_at({0, 0, 0}, {0, 0, 1}, kSide, kSide, 40);
    other_ = test::looking_at({1, 0, 0}, {1, 0, 1}, kSide, kSide, 40);
    for (size_t i = 0; i < priors_.depth.data.size(); ++i) put(i, DepthOrigin::Measured, 4);
  }
  void put(size_t i, DepthOrigin origin, float depth) {
    priors_.origin.data[i] = origin;
    priors_.depth.data[i] = depth;
    priors_.sigma.data[i] = 0.01f;
  }
  // Of the middle of the picture, which the witness sees 40 / depth pixels left of its own.
  bool holds(float depth) const {
    return EmptySpace(camera_, {&other_, &priors_}).holds(20, 20, 1 / depth);
  }

  Camera camera_;
  Camera other_;
  ViewPriors priors_;
};

TEST_F(EmptySpaceTest, IsBeforeWhatTheWitnessMeasured) {
  EXPECT_TRUE(holds(3));
  EXPECT_TRUE(holds(3.8f));
  EXPECT_FALSE(holds(3.95f));  // within 3 % of the wall
  EXPECT_FALSE(holds(4));
  EXPECT_FALSE(holds(6));
}

TEST_F(EmptySpaceTest, TakesTheUncertaintyOfTheWitness) {
  for (float& sigma : priors_.sigma.data) sigma = 0.2f;
  EXPECT_FALSE(holds(3.8f));
  EXPECT_TRUE(holds(3.3f));
}

TEST_F(EmptySpaceTest, IsBeforeTheSkyAtAnyDepth) {
  for (DepthOrigin& origin : priors_.origin.data) origin = DepthOrigin::Sky;
  EXPECT_TRUE(holds(6));
  EXPECT_TRUE(holds(100));
}

TEST_F(EmptySpaceTest, IsNotToldByWhatWasFilledIn) {
  for (const DepthOrigin origin : {DepthOrigin::Completed,
                                   DepthOrigin::Guessed,
                                   DepthOrigin::Estimated,
                                   DepthOrigin::Unknown}) {
    for (DepthOrigin& o : priors_.origin.data) o = origin;
    EXPECT_FALSE(holds(3));
  }
}

TEST_F(EmptySpaceTest, TakesAllFourPixelsAround) {
  put(priors_.depth.index(9, 20), DepthOrigin::Measured, 2);  // the point at 3.8 is seen at 9.97
  EXPECT_FALSE(holds(3.8f));
}

TEST_F(EmptySpaceTest, IsNotToldOutsideOfThePictureOfTheWitness) {
  EXPECT_FALSE(holds(1.5f));  // 27 pixels left of its middle
}

}  // namespace
}  // namespace cgs::empty_space_test
