// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/shared_places.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/photo_response.h"
#include "libcgs/core/srgb.h"

namespace cgs::shared_places_test {
namespace {

constexpr int kWidth = 80;
constexpr int kHeight = 60;
constexpr double kDepth = 2;

// A wall at z = 2, seen from `aside` along x: brighter to the right of the wall.
struct Seen {
  View view;
  ViewPriors priors;
  ColorImage light;

  explicit Seen(double aside) {
    view.camera = {kWidth, kHeight, 80, 80, 40, 30, Eigen::Isometry3d::Identity()};
    view.camera.world_from_cam.translation().x() = aside;
    view.image = ColorImage(kWidth, kHeight, Eigen::Vector3f::Zero());
    priors.depth = DepthMap(kWidth, kHeight, static_cast<float>(kDepth));
    priors.origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Measured);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double there = view.camera.unproject(x + 0.5, y + 0.5, kDepth).x();
        view.image(x, y).setConstant(static_cast<float>(0.5 + 0.1 * there));
      }
    }
    light = smooth_light(view);
  }
  LitView lit() const { return {view, priors, light}; }
};

TEST(SharedPlaces, AreOfTheSamePlaceOfTheSurface) {
  const Seen a(0);
  const Seen b(0.5);  // 20 pixels
  const auto places = shared_places(a.lit(), b.lit());
  EXPECT_GT(places.size(), 100U);
  for (const SharedPlace& place : places) {
    EXPECT_LT((place.a.light - place.b.light).norm(), 1e-3 * place.a.light.norm());
    const double coded = double{srgb_from_linear(static_cast<float>(place.a.light.x()))};
    EXPECT_NEAR(place.coded, coded, 2e-3);
    EXPECT_GE(place.a.r2, 0);
    EXPECT_LE(place.a.r2, 1);
  }
}

TEST(SharedPlaces, MustBeMeasuredAlikeByBoth) {
  const Seen a(0);
  Seen other(0.5);
  other.priors.depth = DepthMap(kWidth, kHeight, static_cast<float>(1.02 * kDepth));
  EXPECT_TRUE(shared_places(a.lit(), other.lit()).empty());
  Seen unmeasured(0.5);
  unmeasured.priors.origin = Raster<DepthOrigin>(kWidth, kHeight, DepthOrigin::Completed);
  EXPECT_TRUE(shared_places(a.lit(), unmeasured.lit()).empty());
  EXPECT_TRUE(shared_places(unmeasured.lit(), a.lit()).empty());
}

TEST(SmoothLight, IsNotToldBesideWhatIsClippedDarkOrMasked) {
  Seen seen(0);
  seen.view.image(20, 20).setConstant(1);
  seen.view.image(40, 20).setConstant(0);
  seen.view.valid = MaskMap(kWidth, kHeight, 1);
  seen.view.valid(60, 20) = 0;
  const ColorImage light = smooth_light(seen.view);
  for (const int x : {20, 40, 60}) {
    for (const int at : {x - 1, x, x + 1}) EXPECT_TRUE(std::isnan(light(at, 20).x())) << at;
    EXPECT_FALSE(std::isnan(light(x + 2, 20).x())) << x;
  }
  EXPECT_TRUE(std::isnan(light(0, 20).x()));
  EXPECT_NEAR(light(30, 30).x(), linear_from_srgb(seen.view.image(30, 30).x()), 1e-3);
}

}  // namespace
}  // namespace cgs::shared_places_test
