// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/next_view.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/camera_row.h"

namespace cgs::next_view_test {
namespace {

constexpr double kWall = 5;

// A wall of splats before the row of cameras, wider than these see, measured by all.
Model wall() {
  Model out = test::row_of_cameras();
  for (ViewPriors& priors : out.priors) {
    const int w = priors.depth.width;
    const int h = priors.depth.height;
    priors.sigma = DepthMap(w, h, 0.01f);
    priors.origin = Raster<DepthOrigin>(w, h, DepthOrigin::Measured);
  }
  for (double x = -8; x <= 8; x += 0.1) {
    for (double y = -4; y <= 4; y += 0.1) {
      out.gaussians.position.emplace_back(x, y, kWall);
      out.gaussians.scale.push_back(Eigen::Vector3f::Constant(0.08f));
      out.gaussians.rotation.emplace_back(1, 0, 0, 0);
      out.gaussians.opacity.push_back(0.95f);
      out.gaussians.sh.emplace_back(0, 0, 0);
    }
  }
  return out;
}

NextView at(const Model& model, double x, const std::string& name) {
  NextView out;
  out.name = name;
  out.camera = input_camera(model, 1);
  out.camera.world_from_cam.translation().x() = x;
  return out;
}

TEST(NextView, IsWhereMostIsOpenAndEnoughIsShared) {
  const Model model = wall();
  NextView away = at(model, 0, "away");
  away.camera.world_from_cam.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  const auto ranked = rank_next_views(
      model, {at(model, 0, "same"), away, at(model, 2.5, "beside"), at(model, 4.4, "far")});
  ASSERT_EQ(ranked.size(), 4u);
  EXPECT_EQ(ranked[0].name, "beside");  // "far" shows more that is new, but shares too little
  EXPECT_EQ(ranked[1].name, "far");
  EXPECT_GT(ranked[1].open, ranked[0].open);
  EXPECT_LT(ranked[1].shared, 0.2);
  for (const size_t i : {2, 3}) EXPECT_EQ(ranked[i].worth, 0) << ranked[i].name;
}

TEST(NextView, WhatNothingMeasuredCountsByHalf) {
  Model model = wall();
  const double measured = rank_next_views(model, {at(model, 1.2, "")})[0].worth;
  for (ViewPriors& priors : model.priors) {
    for (int y = 0; y < priors.origin.height; ++y) {
      for (int x = 20; x < 40; ++x) priors.origin(x, y) = DepthOrigin::Estimated;
    }
  }
  const NextView some = rank_next_views(model, {at(model, 1.2, "")})[0];
  EXPECT_GT(some.unsure, 0.1);
  EXPECT_NEAR(some.worth, some.open + 0.5 * some.unsure, 1e-12);
  EXPECT_GT(some.worth, measured);
}

TEST(NextView, IsToldFromTheNearestInput) {
  const Model model = wall();
  const NextView right = rank_next_views(model, {at(model, 2, "")})[0];
  EXPECT_EQ(right.nearest, 2u);
  EXPECT_NEAR(right.right, std::atan2(1, kWall), 1e-6);
  EXPECT_NEAR(right.higher, 0, 1e-6);
  EXPECT_NEAR(right.farther, std::hypot(1, kWall) / kWall, 1e-6);
}

TEST(NextView, PlacesAroundLookAtTheSameFromAside) {
  const Model model = wall();
  const std::vector<NextView> places = places_around(model);
  ASSERT_FALSE(places.empty());
  // Around what the middle one looks at, as far from it as that stands.
  const Eigen::Vector3d subject = *looked_at(model, 1);
  EXPECT_NEAR((subject - Eigen::Vector3d(0, 0, kWall)).norm(), 0, 1e-5);
  int around = 0;
  for (const NextView& place : places) {
    const Eigen::Vector3d uvz = place.camera.project(subject);
    if (std::abs(uvz.x() - 20) > 1e-3 || std::abs(uvz.y() - 15) > 1e-3) continue;
    EXPECT_NEAR(uvz.z(), kWall, 1e-4);
    ++around;
  }
  EXPECT_EQ(around, static_cast<int>(places.size()) / 3);
}

TEST(NextView, PlacesAroundManyViewsAreNoMoreThanAroundSome) {
  Model model = test::row_of_cameras();
  const std::vector<NextView> few = places_around(model);
  EXPECT_EQ(few.size(), 3 * 12u);
  while (model.priors.size() < 40) {
    model.scene.input.push_back(static_cast<int>(model.priors.size() % 3));
    model.priors.push_back(model.priors.front());
  }
  EXPECT_EQ(places_around(model, 40).size(), 40 * 12u);
  const std::vector<NextView> many = places_around(model);
  EXPECT_LE(many.size(), kMostGoneAround * 12);
  EXPECT_GT(many.size(), kMostGoneAround * 12 / 2);
}

TEST(NextView, SayWhichWayTheyStand) {
  const Model model = wall();
  for (const NextView& place : rank_next_views(model, places_around(model))) {
    // Negative y is up.
    const double up = -place.camera.center().y();
    if (std::abs(place.higher) > 0.1) EXPECT_GT(up * place.higher, 0);
  }
}

TEST(NextView, ThoseApartStandApart) {
  const Model model = wall();
  const auto chosen = apart(model, rank_next_views(model, places_around(model)), 3);
  ASSERT_EQ(chosen.size(), 3u);
  EXPECT_GE(chosen[0].worth, chosen[1].worth);
  EXPECT_GT((chosen[0].camera.center() - chosen[1].camera.center()).norm(), 1);
}

TEST(NextView, NeedsInputViews) { EXPECT_THROW(rank_next_views(Model(), {}), InvalidInput); }

}  // namespace
}  // namespace cgs::next_view_test
