// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/hidden_depth.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace cgs::hidden_depth_test {
namespace {

constexpr int kWidth = 80;
constexpr int kHeight = 50;

// A slanted plane, in which inverse depth is linear.
float plane(int x, int y) {
  return 1 / (0.2f + 0.001f * static_cast<float>(x) - 0.002f * static_cast<float>(y));
}

RenderBuffers plane_buffers() {
  RenderBuffers out;
  out.median_depth = DepthMap(kWidth, kHeight, 0);
  out.hole = Raster<Hole>(kWidth, kHeight, Hole::None);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) out.median_depth(x, y) = plane(x, y);
  }
  return out;
}

MaskMap gap(int left, int top, int right, int bottom) {
  MaskMap out(kWidth, kHeight, 0);
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) out(x, y) = 1;
  }
  return out;
}

TEST(HiddenDepth, GoesOnWithAPlane) {
  const MaskMap open = gap(20, 10, 60, 40);
  const DepthMap found = hidden_depth(plane_buffers(), open);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (open(x, y) == 0) {
        EXPECT_TRUE(std::isnan(found(x, y)));
      } else {
        EXPECT_NEAR(found(x, y) / plane(x, y), 1, 1e-3) << x << ", " << y;
      }
    }
  }
}

// What stands before the plane at the left of the gap, at less than half its depth, has no part.
TEST(HiddenDepth, IsNotPulledNearerByWhatStandsBefore) {
  RenderBuffers buffers = plane_buffers();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 30; ++x) buffers.median_depth(x, y) = 0.4f * plane(x, y);
  }
  const DepthMap found = hidden_depth(buffers, gap(30, 0, 45, kHeight));
  // Where the gap leaves the picture, nothing holds the membrane, and it levels out.
  constexpr int kFreeEnd = 15;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 30; x < 45; ++x) {
      const bool is_free = y < kFreeEnd || y >= kHeight - kFreeEnd;
      EXPECT_NEAR(found(x, y) / plane(x, y), 1, is_free ? 0.25 : 0.12) << x << ", " << y;
    }
  }
}

TEST(HiddenDepth, TakesSkyWhereThereIsNothingElse) {
  RenderBuffers buffers = plane_buffers();
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      buffers.median_depth(x, y) = 1000;
      buffers.hole(x, y) = Hole::Sky;
    }
  }
  EXPECT_LT(hidden_depth(buffers, gap(30, 20, 40, 30))(35, 20), 10);  // beside sky, above a wall
  buffers.hole = Raster<Hole>(kWidth, kHeight, Hole::Sky);
  buffers.median_depth = DepthMap(kWidth, kHeight, 1000);
  EXPECT_NEAR(hidden_depth(buffers, gap(30, 20, 40, 30))(35, 20), 1000, 1);
  buffers.median_depth = DepthMap(kWidth, kHeight, std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(std::isnan(hidden_depth(buffers, gap(30, 20, 40, 30))(35, 20)));
}

}  // namespace
}  // namespace cgs::hidden_depth_test
