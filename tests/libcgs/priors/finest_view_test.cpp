// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/finest_view.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace cgs::finest_view_test {
namespace {

constexpr int kWidth = 48;
constexpr int kHeight = 36;
constexpr double kWall = 6;  // z of the wall that all cameras look at, square to it

struct Views {
  Scene scene;
  std::vector<ViewPriors> priors;

  // A camera at (x, 0, z).
  void add(double x, double z) {
    View view;
    view.camera = {kWidth, kHeight, 60, 60, 24, 18, Eigen::Isometry3d::Identity()};
    view.camera.world_from_cam.translation() << x, 0, z;
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
    ViewPriors own;
    own.depth = DepthMap(kWidth, kHeight, static_cast<float>(kWall - z));
    own.origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Measured);
    priors.push_back(own);
  }

  std::vector<long> marked() {
    mark_shown_finer(scene, priors);
    std::vector<long> out;
    for (const ViewPriors& own : priors) {
      out.push_back(std::count(own.shown_finer.data.begin(), own.shown_finer.data.end(), 1));
    }
    return out;
  }
};

// One camera nearer to the wall than four others.
Views one_near() {
  Views out;
  for (int i = 0; i < 4; ++i) out.add(0.02 * i, 0);
  out.add(0, 3);
  return out;
}

TEST(FinestView, FewViewsDrawAllThatTheyShow) {
  Views views;
  for (int i = 0; i < 4; ++i) views.add(0, 0);
  for (const long count : views.marked()) EXPECT_EQ(count, 0);
}

TEST(FinestView, TheNearestDrawsWhatItShows) {
  Views views = one_near();
  const std::vector<long> marked = views.marked();
  EXPECT_EQ(marked[4], 0);
  // The middle of the others, half as wide, without a rim of three pixels.
  for (int i = 0; i < 4; ++i) {
    EXPECT_GT(marked[i], 18 * 12);
    EXPECT_EQ(views.priors[i].shown_finer(24, 18), 1);
    EXPECT_EQ(views.priors[i].shown_finer(13, 18), 0);
  }
}

TEST(FinestView, EveryPlaceIsDrawnByOneView) {
  Views views;
  for (int i = 0; i < 6; ++i) views.add(0.1 * i, 0.3 * i);
  views.marked();
  for (double x = -1; x <= 1; x += 0.05) {
    const Eigen::Vector3d point(x, 0.1, kWall);
    int shown = 0;
    int drawn = 0;
    for (size_t i = 0; i < views.priors.size(); ++i) {
      const Camera& camera = views.scene.views[i].camera;
      const Eigen::Vector3d uvz = camera.project(point);
      if (!camera.sees(uvz)) continue;
      const MaskMap& elsewhere = views.priors[i].shown_finer;
      ++shown;
      drawn += elsewhere(static_cast<int>(uvz.x()), static_cast<int>(uvz.y())) == 0 ? 1 : 0;
    }
    if (shown > 0) EXPECT_GE(drawn, 1) << x;
    if (shown == 6 && std::abs(x) < 0.5) EXPECT_EQ(drawn, 1) << x;
  }
}

TEST(FinestView, WhatIsMeasuredIsNotDrawnByAViewThatGuesses) {
  Views views = one_near();
  views.priors[4].origin.data.assign(views.priors[4].origin.data.size(), DepthOrigin::Estimated);
  const std::vector<long> marked = views.marked();
  // Nor does a guess stay where another view measured the same.
  EXPECT_EQ(marked[4], 0);
  EXPECT_EQ(views.priors[0].shown_finer(24, 18) + views.priors[1].shown_finer(24, 18) +
                views.priors[2].shown_finer(24, 18) + views.priors[3].shown_finer(24, 18),
            0);
}

TEST(FinestView, AnotherSurfaceIsDrawnApart) {
  Views views = one_near();
  for (int y = 12; y < 24; ++y) {
    for (int x = 16; x < 32; ++x) views.priors[0].depth(x, y) = 5;  // stands before the wall
  }
  views.marked();
  EXPECT_EQ(views.priors[0].shown_finer(24, 18), 0);
  EXPECT_EQ(views.priors[1].shown_finer(24, 18), 1);
}

}  // namespace
}  // namespace cgs::finest_view_test
