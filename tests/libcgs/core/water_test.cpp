// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/water.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "tests/support/stereo_scene.h"

namespace cgs::water_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Water reef() {
  Water out;
  out.attenuation = {0.5, 0.2, 0.1};
  out.backscatter = {0.3, 0.25, 0.2};
  out.veil = {0.05, 0.2, 0.3};
  return out;
}

const Camera kCamera = test::looking_at({0, 0, 0}, {0, 0, 4}, 40, 30, 25);

ColorImage picture() {
  ColorImage out(40, 30, Vector3f::Zero());
  for (size_t i = 0; i < out.data.size(); ++i) {
    const auto k = static_cast<float>(i % 97) / 97;
    out.data[i] = {0.2f + 0.5f * k, 0.7f - 0.4f * k, 0.3f + 0.3f * k};
  }
  return out;
}

// The formula in numbers: linear light 0.25 is 0.537 in sRGB; 2.5 m off the axis by atan(0.75).
TEST(ThroughWater, DimsByTheWayOfTheLightAndAddsTheVeil) {
  Camera camera{.width = 1, .height = 1, .fx = 2, .fy = 2, .cx = -1, .cy = 0.5};
  const ColorImage grey(1, 1, Vector3f::Constant(0.53709872f));
  const ColorImage seen = through_water(grey, camera, DepthMap(1, 1, 2.0f), reef());
  for (int c = 0; c < 3; ++c) {
    const double range = 2 * std::sqrt(1 + 0.75 * 0.75);
    const double light = 0.25 * std::exp(-range * reef().attenuation[c]) +
                         reef().veil[c] * (1 - std::exp(-range * reef().backscatter[c]));
    EXPECT_NEAR(seen.data[0][c], 1.055 * std::pow(light, 1 / 2.4) - 0.055, 1e-5);
  }
}

TEST(ThroughWater, IsUndoneByTheSameWater) {
  DepthMap depth(40, 30, 0);
  for (size_t i = 0; i < depth.data.size(); ++i) depth.data[i] = 1 + 0.001f * float(i);
  const ColorImage clear = picture();
  const ColorImage seen = through_water(clear, kCamera, depth, reef());
  const ColorImage again = without_water(seen, kCamera, depth, reef());
  for (size_t i = 0; i < clear.data.size(); ++i) {
    EXPECT_LT((again.data[i] - clear.data[i]).cwiseAbs().maxCoeff(), 1e-4f) << i;
  }
}

TEST(ThroughWater, TakesTheDepthOfTheNearestPixelThatKnowsIt) {
  DepthMap depth(40, 30, kNaN);
  depth(3, 4) = 2;
  depth(30, 20) = 5;
  DepthMap nearest(40, 30, 2);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      if (std::hypot(x - 30, y - 20) < std::hypot(x - 3, y - 4)) nearest(x, y) = 5;
    }
  }
  const ColorImage found = through_water(picture(), kCamera, depth, reef());
  const ColorImage expected = through_water(picture(), kCamera, nearest, reef());
  size_t same = 0;
  for (size_t i = 0; i < found.data.size(); ++i) same += found.data[i] == expected.data[i] ? 1 : 0;
  EXPECT_GT(same, 0.95 * double(found.data.size())) << "ways go along eight directions";
  EXPECT_EQ(found(4, 4), expected(4, 4));
  EXPECT_EQ(found(29, 19), expected(29, 19));
}

TEST(ThroughWater, LeavesWhatHasNoRangeAsItIs) {
  const ColorImage before = picture();
  EXPECT_EQ(through_water(before, kCamera, DepthMap(40, 30, 0), reef()).data, before.data);
  EXPECT_EQ(without_water(before, kCamera, DepthMap(40, 30, kNaN), reef()).data, before.data);
  EXPECT_THROW(through_water(before, kCamera, DepthMap(3, 3, 1), reef()), InvalidInput);
}

// What is left of light far away is noise, and stays below white where it is made stronger.
TEST(WithoutWater, MakesLightStrongerToALimit) {
  Water thick = reef();
  thick.veil = Vector3d::Zero();
  const ColorImage dim(40, 30, Vector3f::Constant(0.04045f));  // linear 0.0031308
  const ColorImage found = without_water(dim, kCamera, DepthMap(40, 30, 1000), thick);
  EXPECT_NEAR(found.data[0].x(), 1.055 * std::pow(50 * 0.0031308, 1 / 2.4) - 0.055, 1e-3);
}

}  // namespace
}  // namespace cgs::water_test
