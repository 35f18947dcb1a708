// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_completion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/unmeasured_priors.h"

namespace cgs::depth_completion_test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Example {
  View view;
  ViewPriors priors;

  Example(int w, int h) {
    view.camera = {.width = w, .height = h, .fx = 50, .fy = 50, .cx = 0.5 * w, .cy = 0.5 * h};
    view.image = ColorImage(w, h, Eigen::Vector3f::Constant(0.2f));
    priors = test::unmeasured_priors(w, h);
  }
  void measure(int x, int y, float depth) {
    priors.depth(x, y) = depth;
    priors.sigma(x, y) = 0.001f * depth;
    priors.origin(x, y) = DepthOrigin::Measured;
    priors.confidence(x, y) = 1;
  }
};

// A bright square at depth 2 before a dark wall at depth 5; everything within `gap` pixels of the
// square's rim, on both sides, is unmeasured.
Example square_before_wall(int gap) {
  Example e(60, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      const int inside = std::min(std::min(x - 20, 39 - x), std::min(y - 20, 39 - y));
      if (inside >= 0) e.view.image(x, y).setConstant(0.8f);
      if (inside >= gap) e.measure(x, y, 2);
      if (inside < -gap) e.measure(x, y, 5);
    }
  }
  return e;
}

TEST(CompleteDepth, KeepsDepthEdgesOnObjectEdges) {
  Example e = square_before_wall(6);
  complete_depth(e.priors, e.view, {});
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      const bool square = x >= 20 && x < 40 && y >= 20 && y < 40;
      ASSERT_NEAR(e.priors.depth(x, y), square ? 2 : 5, 0.01) << x << ' ' << y;
    }
  }
}

TEST(CompleteDepth, GivesWhatColourCannotTellToTheFartherSurface) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x < 25) e.measure(x, y, 2);
      if (x >= 35) e.measure(x, y, 5);
    }
  }
  complete_depth(e.priors, e.view, {});
  EXPECT_NEAR(e.priors.depth(30, 10), 5, 0.01);
  EXPECT_NEAR(e.priors.depth(33, 10), 5, 0.01);
}

TEST(CompleteDepth, ContinuesASlope) {
  Example e(60, 40);
  const auto truth = [](int x) { return 1 / (0.2f + 0.002f * float(x)); };
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x < 25 || x > 34) e.measure(x, y, truth(x));
    }
  }
  complete_depth(e.priors, e.view, {});
  for (int x = 25; x <= 34; ++x) EXPECT_NEAR(e.priors.depth(x, 20) / truth(x), 1, 0.01) << x;
}

TEST(CompleteDepth, FillsEveryValidPixelAndNoOther) {
  Example e = square_before_wall(6);
  e.view.valid = MaskMap(60, 60, 1);
  for (int x = 0; x < 60; ++x) e.view.valid(x, 17) = 0;
  for (int x = 0; x < 60; ++x) {
    e.priors.origin(x, 17) = DepthOrigin::Unknown;
    e.priors.depth(x, 17) = e.priors.sigma(x, 17) = kNaN;
    e.view.image(x, 17).setConstant(kNaN);
  }
  complete_depth(e.priors, e.view, {});
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      ASSERT_EQ(std::isfinite(e.priors.depth(x, y)), y != 17);
      ASSERT_EQ(e.priors.origin(x, y) == DepthOrigin::Unknown, y == 17);
      if (y != 17) ASSERT_GT(e.priors.sigma(x, y), 0);
    }
  }
}

TEST(CompleteDepth, LeavesMeasuredPixelsAndTrustsOthersLessTheFartherTheyAre) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) e.measure(x, y, 3);
  }
  complete_depth(e.priors, e.view, {});
  EXPECT_EQ(e.priors.depth(10, 10), 3);
  EXPECT_EQ(e.priors.sigma(10, 10), 0.003f);
  EXPECT_GT(e.priors.sigma(21, 10), 0.003f);
  EXPECT_GT(e.priors.sigma(50, 10), e.priors.sigma(21, 10));
  EXPECT_EQ(e.priors.origin(50, 10), DepthOrigin::Completed);
  EXPECT_EQ(e.priors.confidence(50, 10), 0);
}

// Completes a view beside a second one, to the left, that measures `seen` everywhere.
void complete_beside(float seen, const DepthCompletionOptions& options, Example& e) {
  Example witness(60, 20);
  witness.view.camera.world_from_cam.translation().x() = -0.2;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) witness.measure(x, y, seen);
  }
  complete_depth(e.priors, e.view, options, {{&witness.view.camera, &witness.priors}});
}

// A gap between surfaces at depths 2 and 5, all of one colour, so near the left rim its pixels
// would go with the nearer one; a second view, to the left, measures `seen` everywhere.
Example gap_with_witness(float seen) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x < 25) e.measure(x, y, 2);
      if (x >= 35) e.measure(x, y, 5);
    }
  }
  complete_beside(seen, {.background_share = 1}, e);
  return e;
}

TEST(CompleteDepth, PutsNothingWhereAnotherViewLooksThrough) {
  const Example through = gap_with_witness(5);
  for (int x = 25; x < 35; ++x) EXPECT_NEAR(through.priors.depth(x, 10), 5, 0.01) << x;
  const Example stopped = gap_with_witness(2);
  for (int x = 25; x < 35; ++x) EXPECT_NEAR(stopped.priors.depth(x, 10), 2, 0.01) << x;
}

TEST(CompleteDepth, MovesBackWhereOtherViewsLeaveNoEvidence) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 25; ++x) e.measure(x, y, 2);
  }
  complete_beside(4, {}, e);
  // As near as the margin of the test and the step of the search allow.
  EXPECT_NEAR(e.priors.depth(30, 10), 4, 0.05 * 4);
}

TEST(CompleteDepth, LeavesOpenWhatWouldStandFarBeforeWhatAnotherViewMeasured) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 25; ++x) e.measure(x, y, 2);
  }
  complete_beside(40, {}, e);
  for (int x = 25; x < 50; ++x) {
    EXPECT_EQ(e.priors.origin(x, 10), DepthOrigin::Unknown) << x;
    EXPECT_TRUE(std::isnan(e.priors.depth(x, 10))) << x;
  }
}

// Smoothing leads from where they moved back to towards what is measured beside them.
TEST(CompleteDepth, LeavesNothingInTheWayOfAnotherViewAfterSmoothing) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x < 25) e.measure(x, y, 2);
      if (x >= 35) e.measure(x, y, 2.08f);
    }
  }
  complete_beside(2.2f, {}, e);
  const float in_the_way = 0.97f * 2.2f;
  for (int x = 25; x < 35; ++x) EXPECT_GE(e.priors.depth(x, 10), in_the_way - 1e-4f) << x;
}

// Between surfaces at 2 and 5 of one colour lies sky.
TEST(CompleteDepth, LooksForEvidenceOnThisSideOfTheSky) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x < 10) e.measure(x, y, 2);
      if (x >= 50) e.measure(x, y, 5);
      if (x >= 35 && x < 38) e.priors.origin(x, y) = DepthOrigin::Sky;
    }
  }
  complete_depth(e.priors, e.view, {});
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x >= 35 && x < 38) {
        ASSERT_EQ(e.priors.origin(x, y), DepthOrigin::Sky);
        ASSERT_TRUE(std::isnan(e.priors.depth(x, y)));
      } else {
        ASSERT_NEAR(e.priors.depth(x, y), x < 35 ? 2 : 5, 0.01) << x << ' ' << y;
      }
    }
  }
}

TEST(CompleteDepth, LeavesOpenWhatWouldStandBeforeTheSkyOfAnotherView) {
  Example e(60, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 25; ++x) e.measure(x, y, 2);
  }
  Example witness(60, 20);
  witness.view.camera.world_from_cam.translation().x() = -0.2;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      witness.measure(x, y, 2);
      if (x < 30) continue;  // where it sees the 25 columns
      witness.priors.origin(x, y) = DepthOrigin::Sky;
      witness.priors.depth(x, y) = witness.priors.sigma(x, y) = kNaN;
    }
  }
  complete_depth(e.priors, e.view, {}, {{&witness.view.camera, &witness.priors}});
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 60; ++x) {
      if (x < 25) ASSERT_EQ(e.priors.origin(x, y), DepthOrigin::Measured);
      // At any depth these are in its picture, and in its sky.
      if (x < 32 || x > 53) continue;
      ASSERT_EQ(e.priors.origin(x, y), DepthOrigin::Unknown) << x << ' ' << y;
      ASSERT_TRUE(std::isnan(e.priors.depth(x, y)));
      ASSERT_TRUE(std::isnan(e.priors.sigma(x, y)));
    }
  }
}

TEST(CompleteDepth, NeedsEvidenceOrAFallback) {
  Example e(8, 8);
  EXPECT_THROW(complete_depth(e.priors, e.view, {}), NumericalError);
  complete_depth(e.priors, e.view, {.fallback_depth = 4});
  EXPECT_FLOAT_EQ(e.priors.depth(4, 4), 4);
}

TEST(DepthCompletionOptions, RefusesEachFieldOutOfRange) {
  EXPECT_NO_THROW(DepthCompletionOptions{}.validate());
  std::vector<DepthCompletionOptions> bad(5);
  bad[0].fallback_depth = -1;
  bad[1].level_scale = 0;
  bad[2].background_share = 1.5f;
  bad[3].sigma_per_pixel = kNaN;
  bad[4].smoothing_rounds = -1;
  for (const DepthCompletionOptions& options : bad) EXPECT_THROW(options.validate(), InvalidInput);
}

}  // namespace
}  // namespace cgs::depth_completion_test
