// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/forgotten_views.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/unmeasured_priors.h"

namespace cgs::forgotten_views_test {
namespace {

constexpr float kDepth = 2;  // of a wall before all cameras

/// Views of the wall side by side, of which nothing is measured yet.
struct Example {
  Scene scene;
  std::vector<ViewPriors> priors;

  void add(int side, double x) {
    View view;
    view.camera = {
        .width = side, .height = side, .fx = 40, .fy = 40, .cx = 0.5 * side, .cy = 0.5 * side};
    view.camera.world_from_cam.translation().x() = x;
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
    priors.push_back(test::unmeasured_priors(side, side));
  }
  /// A square in the middle, as confirmed by two others.
  void measure(size_t view, int side) {
    ViewPriors& own = priors[view];
    const int first = (own.depth.width - side) / 2;
    for (int y = first; y < first + side; ++y) {
      for (int x = first; x < first + side; ++x) {
        own.depth(x, y) = kDepth;
        own.sigma(x, y) = 0.001f * kDepth;
        own.origin(x, y) = DepthOrigin::Measured;
        own.matched_views(x, y) = 2;
      }
    }
  }
};

TEST(LeastMeasured, IsOfTheSmallerOfTwoPictures) {
  Example e;
  e.add(100, 0);
  e.add(10, 0.05);  // as through a long lens: a hundredth of the other
  EXPECT_EQ(least_measured(e.scene, e.priors, 0), kLeastMeasured) << "nothing is measured of both";
  e.measure(0, 8);
  e.measure(1, 8);
  EXPECT_DOUBLE_EQ(least_measured(e.scene, e.priors, 0), kLeastMeasured / 100);
  EXPECT_EQ(least_measured(e.scene, e.priors, 1), kLeastMeasured);
}

TEST(LeastMeasured, IsThatOfTheViewWhereTheMeasuredIsElsewhere) {
  Example e;
  e.add(100, 0);
  e.add(10, 3);  // looks past it
  e.measure(0, 8);
  EXPECT_EQ(least_measured(e.scene, e.priors, 0), kLeastMeasured);
}

Example three_in_a_row() {
  Example e;
  for (const double x : {-0.1, 0.0, 0.1}) e.add(40, x);  // 2 pixels from one to the next
  for (size_t k = 0; k < 3; ++k) e.measure(k, 40);
  return e;
}

TEST(ForgetViews, LeavesNothingOfThemButTheBackground) {
  Example e = three_in_a_row();
  e.priors[1].origin(7, 7) = DepthOrigin::Background;
  forget_views(e.scene, {0, 1, 0}, e.priors);
  for (size_t i = 0; i < e.priors[1].depth.data.size(); ++i) {
    ASSERT_TRUE(std::isnan(e.priors[1].depth.data[i]));
    ASSERT_TRUE(std::isnan(e.priors[1].sigma.data[i]));
    ASSERT_EQ(e.priors[1].matched_views.data[i], 0);
  }
  EXPECT_EQ(e.priors[1].origin(7, 7), DepthOrigin::Background);
  EXPECT_EQ(e.priors[1].origin(8, 7), DepthOrigin::Unknown);
  EXPECT_EQ(e.priors[0].depth(20, 20), kDepth);
}

// Else a place would count as seen by two photographs of which one is not used.
TEST(ForgetViews, CountsAnewWhatTheyMayHaveConfirmed) {
  Example e = three_in_a_row();
  forget_views(e.scene, {0, 1, 0}, e.priors);
  EXPECT_EQ(e.priors[0].matched_views(20, 20), 1) << "by the last";
  EXPECT_EQ(e.priors[2].matched_views(20, 20), 1) << "by the first";
  EXPECT_EQ(e.priors[0].matched_views(3, 20), 0) << "left of the last, not of the middle one";
  EXPECT_EQ(e.priors[0].matched_views(1, 20), 2) << "left of both";
  Example alone = three_in_a_row();
  forget_views(alone.scene, {0, 1, 1}, alone.priors);
  EXPECT_EQ(alone.priors[0].matched_views(20, 20), 0);
  Example all = three_in_a_row();
  forget_views(all.scene, {0, 0, 0}, all.priors);
  EXPECT_EQ(all.priors[0].matched_views.data, three_in_a_row().priors[0].matched_views.data);
}

}  // namespace
}  // namespace cgs::forgotten_views_test
