// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/synthetic_sight.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/panel_model.h"

namespace cgs::synthetic_sight_test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// An input view at (x, 0, 0) that looks along z and saw a wall everywhere; NaN = it saw nothing.
SupportView view_of_wall(float depth, double x = 0) {
  SupportView out;
  out.camera = {40, 30, 50, 50, 20, 15, Eigen::Isometry3d::Identity()};
  out.camera.world_from_cam.translation().x() = x;
  out.depth = DepthMap(40, 30, depth);
  return out;
}

/// From a depth on, on the ray through pixel (20, 15) of a camera at the origin.
float hidden_from(const std::vector<SupportView>& inputs, float depth) {
  return hidden_from_all(inputs, view_of_wall(1).camera, 20, 15, depth);
}

/// That a depth lies a hundredth behind what was seen, or less than a step of a hundredth more.
void expect_right_behind(double depth, double seen) {
  constexpr double kRounding = 1e-6;
  EXPECT_GE(depth, 1.01 * seen * (1 - kRounding));
  EXPECT_LE(depth, 1.01 * 1.01 * seen * (1 + kRounding));
}

TEST(HiddenFromAll, IsAHundredthBehindWhatWasSeen) {
  const float found = hidden_from({view_of_wall(5)}, 1);
  expect_right_behind(found, 5);
  const double steps = std::log(double{found}) / std::log(1.01);
  EXPECT_NEAR(steps, std::round(steps), 1e-3);
  expect_right_behind(hidden_from({view_of_wall(5)}, 5), 5);
  EXPECT_EQ(hidden_from({view_of_wall(5)}, 6), 6) << "it is behind already";
  expect_right_behind(hidden_from({view_of_wall(7), view_of_wall(3)}, 1), 7);
  expect_right_behind(hidden_from({view_of_wall(3), view_of_wall(7)}, 1), 7);
}

TEST(HiddenFromAll, IsAtOnceWhereNobodyLooksOrSaw) {
  EXPECT_EQ(hidden_from({}, 2), 2);
  EXPECT_EQ(hidden_from({view_of_wall(kNaN)}, 2), 2);
  SupportView away = view_of_wall(5);
  away.camera.world_from_cam.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(hidden_from({away}, 2), 2);
  expect_right_behind(hidden_from({away, view_of_wall(kNaN), view_of_wall(5)}, 2), 5);
}

// The picture of a view two units aside begins at 0.4 z: the ray comes into it at a depth of 4.9.
TEST(HiddenFromAll, MayBeBesideAPictureButNotInIt) {
  const SupportView aside = view_of_wall(20, 2);
  EXPECT_EQ(hidden_from({aside}, 1), 1);
  EXPECT_EQ(hidden_from({aside}, 4.8f), 4.8f);
  expect_right_behind(hidden_from({aside}, 4.95f), 20);
  expect_right_behind(hidden_from({aside, view_of_wall(3)}, 1), 3);
  expect_right_behind(hidden_from({aside, view_of_wall(6)}, 1), 20);
}

TEST(HiddenFromAll, IsNowhereBeyondAThousandTimesTheDepth) {
  EXPECT_TRUE(std::isnan(hidden_from({view_of_wall(1e6f)}, 1)));
  EXPECT_TRUE(std::isnan(hidden_from({view_of_wall(1e6f)}, 900)));
  expect_right_behind(hidden_from({view_of_wall(1e6f)}, 1100), 1e6);
}

/// Small balls, each with a number of its own from 1 on.
Gaussians balls(const std::vector<Eigen::Vector3f>& places, float opacity = 0.9f) {
  Gaussians out;
  out.position = places;
  out.scale.assign(places.size(), Eigen::Vector3f::Constant(0.02f));
  out.rotation.assign(places.size(), Eigen::Vector4f::UnitX());
  out.opacity.assign(places.size(), opacity);
  out.sh.assign(places.size(), Eigen::Vector3f::Zero());
  out.synthetic.resize(places.size());
  std::iota(out.synthetic.begin(), out.synthetic.end(), uint8_t{1});
  return out;
}

/// The numbers of those that are left.
std::vector<uint8_t> left(const SyntheticSight& sight, Gaussians fill) {
  sight.drop_visible(fill);
  EXPECT_EQ(fill.size(), fill.synthetic.size());
  return fill.synthetic;
}

TEST(SyntheticSight, OnlyWhatInputViewsShowIsDropped) {
  const Model model = test::panel_model();
  const SyntheticSight sight(model);
  const Eigen::Vector3f before(0.5f, 0.3f, 2);
  const Eigen::Vector3f behind_panel(0, 0, 4.5f);
  const Eigen::Vector3f behind_cameras(0, 0, -2);
  const Eigen::Vector3f outside(30, 0, 2);
  EXPECT_EQ(left(sight, balls({before, behind_panel, behind_cameras, outside})),
            (std::vector<uint8_t>{2, 3, 4}));
  EXPECT_EQ(left(sight, balls({behind_panel, before})), std::vector<uint8_t>{1});
  EXPECT_TRUE(left(sight, balls({before, before})).empty());
  EXPECT_TRUE(left(sight, Gaussians()).empty());
}

// Before the middle of the panel, which all photographs show.
TEST(SyntheticSight, WhatIsSeenThroughMayShineByASixteenth) {
  const Model model = test::panel_model();
  const SyntheticSight sight(model);
  const auto kept = [&](float opacity) { return left(sight, balls({{0, 0, 2}}, opacity)).size(); };
  EXPECT_EQ(kept(1.0f / 32), 1U);
  EXPECT_EQ(kept(0.2f), 0U);
}

TEST(SyntheticSight, InAHoleNothingShines) {
  Model model;
  View view;
  view.camera = test::panel_camera(0);
  model.scene.views.push_back(view);
  model.scene.input = {0};
  ViewPriors& priors = model.priors.emplace_back();
  priors.depth = DepthMap(view.camera.width, view.camera.height, kNaN);
  priors.sigma = priors.depth;
  priors.origin = Raster<DepthOrigin>(view.camera.width, view.camera.height, DepthOrigin::Unknown);
  const SyntheticSight sight(model);
  const auto kept = [&](float opacity) { return left(sight, balls({{0, 0, 2}}, opacity)).size(); };
  EXPECT_EQ(kept(1.0f / 32), 0U);
  EXPECT_EQ(kept(1.0f / 300), 1U) << "not drawn at all";
}

// A hundred balls before the upper half of the panel, and a hundred behind the lower one.
TEST(SyntheticSight, TellsManyApartForAnyNumberOfThreads) {
  const Model model = test::panel_model();
  std::mt19937 random(7);
  const auto between = [&](float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  };
  std::vector<Eigen::Vector3f> places;
  std::vector<uint8_t> hidden;
  for (int i = 0; i < 100; ++i) {
    const float x = between(-0.5f, 0.5f);
    places.emplace_back(x, between(-0.6f, -0.2f), 2.0f);
  }
  for (int i = 0; i < 100; ++i) {
    const float x = between(-0.4f, 0.4f);
    const float z = between(3.5f, 4.8f);
    places.emplace_back(x, 0.15f * z, z);
    hidden.push_back(static_cast<uint8_t>(places.size()));
  }
  for (const size_t threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(left(SyntheticSight(model), balls(places)), hidden) << threads;
  }
}

}  // namespace
}  // namespace cgs::synthetic_sight_test
