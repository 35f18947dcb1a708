// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/picture.h"

#include <limits>

#include <gtest/gtest.h>

namespace cgs::picture_test {
namespace {

const Eigen::Vector3f kNear(0.9f, 0.1f, 0.1f);
const Eigen::Vector3f kFar(0.1f, 0.2f, 0.8f);

/// A near thing on the left, the far side on the right, a gap of nothing between them.
RenderBuffers gap_behind_an_edge(int width, int height, int from, int to) {
  RenderBuffers out;
  out.color = ColorImage(width, height, Eigen::Vector3f::Zero());
  out.alpha = Raster<float>(width, height, 0);
  out.median_depth = DepthMap(width, height, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (x >= from && x < to) continue;
      out.color(x, y) = x < from ? kNear : kFar;
      out.alpha(x, y) = 1;
      out.median_depth(x, y) = x < from ? 1.0f : 3.0f;
    }
  }
  return out;
}

TEST(Picture, DividesByAlphaAboveOneHalfOnly) {
  RenderBuffers buffers;
  buffers.color = ColorImage(2, 1, Eigen::Vector3f(0.3f, 0.3f, 0.3f));
  buffers.alpha = Raster<float>(2, 1, 0.6f);
  buffers.alpha(1, 0) = 0.4f;
  const ColorImage shown = picture(buffers);
  EXPECT_NEAR(shown(0, 0).x(), 0.5f, 1e-6f);
  EXPECT_NEAR(shown(1, 0).x(), 0.3f, 1e-6f);
}

// What covers half of a pixel or more is all that it shows, whatever lies behind.
TEST(Picture, ShowsABackgroundWhereLessThanHalfIsCovered) {
  RenderBuffers buffers;
  buffers.color = ColorImage(3, 1, 0.6f * kNear);
  buffers.alpha = Raster<float>(3, 1, 0.6f);
  buffers.color(1, 0) = 0.25f * kNear;
  buffers.alpha(1, 0) = 0.25f;
  buffers.color(2, 0).setZero();
  buffers.alpha(2, 0) = 0;
  const ColorImage shown = picture(buffers, kFar);
  EXPECT_LT((shown(0, 0) - kNear).norm(), 1e-6f);
  EXPECT_LT((shown(1, 0) - (0.25f * kNear + 0.75f * kFar)).norm(), 1e-6f);
  EXPECT_EQ(shown(2, 0), kFar);
}

TEST(FilledPicture, GoesOnWithTheFarSideBehindAnEdge) {
  for (const int width : {64, 61}) {  // of sizes that halve and that do not
    const RenderBuffers buffers = gap_behind_an_edge(width, 47, 20, 31);
    const ColorImage shown = filled_picture(buffers);
    for (int y = 0; y < 47; ++y) {
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector3f& expected = x < 20 ? kNear : kFar;
        // A depth of a third counts 3^-8 as much.
        EXPECT_LT((shown(x, y) - expected).norm(), 0.01f) << x << ", " << y;
      }
    }
  }
}

// Its backdrop is the farthest of all.
TEST(FilledPicture, DoesNotPreferTheSky) {
  RenderBuffers buffers = gap_behind_an_edge(40, 40, 18, 22);
  buffers.hole = Raster<Hole>(40, 40, Hole::None);
  for (int y = 0; y < 40; ++y) {
    for (int x = 22; x < 40; ++x) {
      buffers.hole(x, y) = Hole::Sky;
      buffers.median_depth(x, y) = 1000;
    }
  }
  const Eigen::Vector3f beside_the_thing = filled_picture(buffers)(18, 20);
  EXPECT_LT((beside_the_thing - kNear).norm(), (beside_the_thing - kFar).norm());
}

// One side of a wide gap does not take all of it, as steps would show where cells of the pyramid
// end.
TEST(FilledPicture, WideGapsAreSmooth) {
  const ColorImage shown = filled_picture(gap_behind_an_edge(512, 64, 40, 470));
  for (int x = 80; x < 430; ++x) {
    EXPECT_LT((shown(x, 32) - shown(x - 1, 32)).norm(), 0.08f) << x;
  }
}

TEST(FilledPicture, LeavesWhatIsShownAsItIs) {
  const RenderBuffers buffers = gap_behind_an_edge(33, 16, 11, 20);
  const ColorImage filled = filled_picture(buffers);
  const ColorImage plain = picture(buffers);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 33; ++x) {
      if (x >= 11 && x < 20) continue;
      EXPECT_EQ(filled(x, y), plain(x, y));
    }
  }
}

TEST(FilledPicture, LaysWhatIsThinlyCoveredOverTheFill) {
  RenderBuffers buffers = gap_behind_an_edge(32, 8, 0, 4);
  buffers.alpha(2, 3) = 0.25f;
  buffers.color(2, 3) = 0.25f * kNear;
  const ColorImage shown = filled_picture(buffers);
  EXPECT_LT((shown(2, 3) - (0.25f * kNear + 0.75f * kFar)).norm(), 1e-5f);
}

TEST(FilledPicture, IsBlackWhereNothingIsShownAnywhere) {
  const RenderBuffers buffers = gap_behind_an_edge(5, 3, 0, 5);
  for (const Eigen::Vector3f& color : filled_picture(buffers).data) {
    EXPECT_EQ(color, Eigen::Vector3f(Eigen::Vector3f::Zero()));
  }
}

}  // namespace
}  // namespace cgs::picture_test
