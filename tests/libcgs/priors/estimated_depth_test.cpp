// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/estimated_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/unmeasured_priors.h"

namespace cgs::estimated_depth_test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kSide = 40;

// The pixels from one corner to before the other.
struct Box {
  int x0, y0, x1, y1;

  bool contains(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
};

// A grey picture of which nothing is known.
struct Example {
  View view;
  ViewPriors priors;

  Example() {
    view.image = ColorImage(kSide, kSide, Eigen::Vector3f::Constant(0.3f));
    priors = test::unmeasured_priors(kSide, kSide);
  }
  void put(const Box& box, DepthOrigin origin, float depth = 2) {
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        priors.origin(x, y) = origin;
        priors.depth(x, y) = depth;
        priors.sigma(x, y) = depth / 100;
      }
    }
  }
  DepthOrigin origin(int x, int y) const { return priors.origin(x, y); }
  auto count(DepthOrigin origin) const {
    return std::count(priors.origin.data.begin(), priors.origin.data.end(), origin);
  }
};

constexpr Box kAll = {0, 0, kSide, kSide};
constexpr Box kSquare = {15, 15, 25, 25};

// A measured square amid what was filled in.
Example measured_square(DepthOrigin around = DepthOrigin::Completed) {
  Example e;
  e.put(kAll, around);
  e.put(kSquare, DepthOrigin::Measured);
  return e;
}

// Length of the shortest way from the square over the eight neighbours of pixels.
double way_to_square(int x, int y) {
  const int dx = std::max({kSquare.x0 - x, x - (kSquare.x1 - 1), 0});
  const int dy = std::max({kSquare.y0 - y, y - (kSquare.y1 - 1), 0});
  return std::max(dx, dy) + (std::sqrt(2.0) - 1) * std::min(dx, dy);
}

TEST(MarkEstimated, EndsEvidenceAsFarFromMeasuredPixelsAsItIsTold) {
  for (const DepthOrigin around : {DepthOrigin::Completed, DepthOrigin::Guessed}) {
    for (const float way : {0.0f, 2.5f, 4.0f}) {
      Example e = measured_square(around);
      mark_estimated(e.priors, e.view, {.way = way});
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const DepthOrigin expected = kSquare.contains(x, y)       ? DepthOrigin::Measured
                                       : way_to_square(x, y) <= way ? around
                                                                    : DepthOrigin::Estimated;
          ASSERT_EQ(e.origin(x, y), expected) << x << ' ' << y << ", way " << way;
        }
      }
    }
  }
}

TEST(MarkEstimated, KeepsDepthAndItsUncertainty) {
  Example e = measured_square();
  mark_estimated(e.priors, e.view);
  EXPECT_EQ(e.origin(0, 0), DepthOrigin::Estimated);
  EXPECT_EQ(e.priors.depth(0, 0), 2);
  EXPECT_EQ(e.priors.sigma(0, 0), 0.02f);
}

TEST(MarkEstimated, EndsEvidenceAtColourEdges) {
  Example e = measured_square();
  for (int y = 0; y < kSide; ++y) {
    for (int x = kSquare.x1 + 1; x < kSide; ++x) e.view.image(x, y).setConstant(0.6f);
  }
  mark_estimated(e.priors, e.view);
  EXPECT_EQ(e.origin(kSquare.x1, 20), DepthOrigin::Completed);
  EXPECT_EQ(e.origin(kSquare.x1 + 1, 20), DepthOrigin::Estimated);
  EXPECT_EQ(e.origin(kSquare.x0 - 4, 20), DepthOrigin::Completed) << "of one colour";
}

TEST(MarkEstimated, CountsColoursThatChangeSlowlyAsAWay) {
  Example e = measured_square();
  for (int y = 0; y < kSide; ++y) {
    // Each pixel costs as much as two.
    for (int x = 0; x < kSide; ++x) e.view.image(x, y).setConstant(0.039f * float(x % 20));
  }
  mark_estimated(e.priors, e.view);
  EXPECT_EQ(e.origin(kSquare.x1 + 1, 20), DepthOrigin::Completed);
  EXPECT_EQ(e.origin(kSquare.x1 + 2, 20), DepthOrigin::Estimated);
}

TEST(MarkEstimated, EndsEvidenceAtDepthSteps) {
  Example e = measured_square();
  e.put({kSquare.x1 + 1, 0, kSide, kSide}, DepthOrigin::Completed, 2.1f);
  // A slope is one surface.
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSquare.x0; ++x) {
      e.priors.depth(x, y) = 2 + 0.015f * float(kSquare.x0 - x);
    }
  }
  mark_estimated(e.priors, e.view);
  EXPECT_EQ(e.origin(kSquare.x1, 20), DepthOrigin::Completed);
  EXPECT_EQ(e.origin(kSquare.x1 + 1, 20), DepthOrigin::Estimated);
  EXPECT_EQ(e.origin(kSquare.x0 - 4, 20), DepthOrigin::Completed);
  EXPECT_EQ(e.origin(kSquare.x0 - 5, 20), DepthOrigin::Estimated);
}

TEST(MarkEstimated, ChangesNothingElse) {
  Example e = measured_square();
  e.put({0, 0, kSide, 5}, DepthOrigin::Sky, 100);
  e.put({0, 5, kSide, 8}, DepthOrigin::Unknown, kNaN);
  e.put({2, 30, 3, 31}, DepthOrigin::Measured);  // alone
  const Raster<DepthOrigin> before = e.priors.origin;
  mark_estimated(e.priors, e.view);
  for (size_t i = 0; i < before.data.size(); ++i) {
    if (before.data[i] == DepthOrigin::Completed) continue;
    ASSERT_EQ(e.priors.origin.data[i], before.data[i]);
  }
  EXPECT_EQ(e.origin(3, 31), DepthOrigin::Completed) << "beside a single measured pixel";
  EXPECT_GT(e.count(DepthOrigin::Estimated), 0);
}

// It is not seen through what has no depth.
TEST(MarkEstimated, GoesNoWayOverWhatHasNoDepth) {
  Example e = measured_square();
  e.put({kSquare.x1, 0, kSquare.x1 + 1, kSide}, DepthOrigin::Unknown, kNaN);
  mark_estimated(e.priors, e.view);
  EXPECT_EQ(e.origin(kSquare.x1 + 1, 20), DepthOrigin::Estimated);
}

TEST(LimitCompletion, KeepsTheNearestPixelsAndNoMoreThanAreKnown) {
  Example e = measured_square();
  limit_completion(e.priors);
  // A hundred are measured; of the rings around them the first two have 96 pixels.
  EXPECT_EQ(e.count(DepthOrigin::Measured), 100);
  EXPECT_EQ(e.count(DepthOrigin::Completed), 96);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool is_near = Box{13, 13, 27, 27}.contains(x, y);
      ASSERT_EQ(e.origin(x, y) == DepthOrigin::Unknown, !is_near) << x << ' ' << y;
      ASSERT_EQ(std::isnan(e.priors.depth(x, y)), !is_near);
      ASSERT_EQ(std::isnan(e.priors.sigma(x, y)), !is_near);
    }
  }
}

TEST(LimitCompletion, ChangesNothingWhereMoreIsMeasured) {
  Example e;
  e.put(kAll, DepthOrigin::Measured);
  e.put({0, 0, kSide, 20}, DepthOrigin::Completed);
  const Raster<DepthOrigin> before = e.priors.origin;
  limit_completion(e.priors);
  EXPECT_EQ(e.priors.origin.data, before.data);
}

TEST(LimitCompletion, CountsGuessedPixelsAsKnown) {
  Example e = measured_square();
  e.put({0, 0, kSide, 10}, DepthOrigin::Guessed);
  e.put({0, 10, kSide, 11}, DepthOrigin::Sky);
  limit_completion(e.priors);
  EXPECT_EQ(e.count(DepthOrigin::Guessed), 400);
  EXPECT_EQ(e.count(DepthOrigin::Sky), 40);
  EXPECT_LE(e.count(DepthOrigin::Completed), 500);
  EXPECT_GT(e.count(DepthOrigin::Completed), 300);
  EXPECT_EQ(e.origin(0, 11), DepthOrigin::Completed) << "beside what is guessed";
  EXPECT_EQ(e.origin(0, kSide - 1), DepthOrigin::Unknown);
}

TEST(LimitCompletion, LeavesNothingWhereNothingIsKnown) {
  Example e;
  e.put(kAll, DepthOrigin::Completed);
  limit_completion(e.priors);
  EXPECT_EQ(e.count(DepthOrigin::Unknown), kSide * kSide);
}

// Whether the estimated patch at a pixel of the column in the middle is; nothing else ever is.
bool is_framed(const Example& e, int y = 20) {
  const MaskMap framed = framed_estimates(e.priors);
  for (size_t i = 0; i < framed.data.size(); ++i) {
    if (framed.data[i] != 0) EXPECT_EQ(e.priors.origin.data[i], DepthOrigin::Estimated);
  }
  return framed(20, y) != 0;
}

Example measured_wall() {
  Example e;
  e.put(kAll, DepthOrigin::Measured);
  return e;
}

TEST(FramedEstimates, AreEnclosedByEvidenceAtLikeDepth) {
  for (const DepthOrigin around :
       {DepthOrigin::Measured, DepthOrigin::Completed, DepthOrigin::Guessed}) {
    Example e;
    e.put(kAll, around);
    e.put(kSquare, DepthOrigin::Estimated, 2.03f);
    EXPECT_TRUE(is_framed(e));
    const MaskMap framed = framed_estimates(e.priors);
    EXPECT_EQ(std::count(framed.data.begin(), framed.data.end(), 1), 100);
  }
}

TEST(FramedEstimates, AreNotAtTheBorderOfThePicture) {
  Example inside = measured_wall();
  inside.put({5, 18, 35, 22}, DepthOrigin::Estimated);
  EXPECT_TRUE(is_framed(inside));
  Example at_border = measured_wall();
  at_border.put({5, kSide - 4, 35, kSide}, DepthOrigin::Estimated);
  EXPECT_FALSE(is_framed(at_border, kSide - 2));
}

TEST(FramedEstimates, AreNotBesideTheSky) {
  Example e = measured_wall();
  e.put({0, 0, kSide, 18}, DepthOrigin::Sky, 2);
  e.put({15, 18, 25, 22}, DepthOrigin::Estimated);
  EXPECT_FALSE(is_framed(e));
}

TEST(FramedEstimates, AreNotBehindADepthStep) {
  for (const float depth : {1.9f, 2.1f}) {
    Example e = measured_wall();
    e.put(kSquare, DepthOrigin::Estimated, depth);
    EXPECT_FALSE(is_framed(e));
  }
}

TEST(FramedEstimates, StandForLittleBesideTheEvidence) {
  for (const bool is_little : {true, false}) {
    Example e = measured_wall();
    const int side = is_little ? 17 : 18;  // a quarter of the rest: 17.9
    e.put({11, 11, 11 + side, 11 + side}, DepthOrigin::Estimated);
    EXPECT_EQ(is_framed(e), is_little);
  }
}

TEST(FramedEstimates, AreJudgedPatchByPatch) {
  Example e = measured_wall();
  e.put({18, 18, 23, 23}, DepthOrigin::Estimated);
  e.put({0, 30, kSide, kSide}, DepthOrigin::Estimated);
  EXPECT_TRUE(is_framed(e));
  EXPECT_FALSE(is_framed(e, 35));
  // A surface of another depth amid the patch is another one.
  e.put({20, 20, 21, 21}, DepthOrigin::Estimated, 3);
  EXPECT_FALSE(is_framed(e));
  EXPECT_EQ(framed_estimates(e.priors)(18, 18), 1);
}

TEST(FramedEstimates, AreNoneWhereNothingIsEstimated) {
  EXPECT_EQ(framed_estimates(measured_wall().priors).data, MaskMap(kSide, kSide, 0).data);
}

TEST(AdjoiningOptions, RefusesEachFieldOutOfRangeByItsName) {
  EXPECT_NO_THROW(AdjoiningOptions{}.validate());
  const auto refusal = [](const AdjoiningOptions& options) -> std::string {
    try {
      options.validate();
    } catch (const InvalidInput& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(refusal({.way = -1}).find("AdjoiningOptions.way "), std::string::npos);
  EXPECT_NE(refusal({.level_scale = 0}).find("AdjoiningOptions.level_scale "), std::string::npos);
  EXPECT_NE(refusal({.largest_step = kNaN}).find("AdjoiningOptions.largest_step "),
            std::string::npos);
  Example e = measured_square();
  EXPECT_THROW(mark_estimated(e.priors, e.view, {.way = kNaN}), InvalidInput);
}

}  // namespace
}  // namespace cgs::estimated_depth_test
