// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/water_evidence.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/priors/water.h"
#include "tests/support/stereo_scene.h"

namespace cgs::water_evidence_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// A wall and a square before it; one camera stands nearer.
const std::vector<test::TexturedPatch> kPatches = {
    {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY()},
    {Vector3d(0, 0, 4), Vector3d::UnitX(), Vector3d::UnitY(), 0.6, 0.6}};

Water reef() {
  Water out;
  out.attenuation = {0.4, 0.2, 0.12};
  out.backscatter = {0.3, 0.25, 0.2};
  out.veil = {0.05, 0.16, 0.25};
  return out;
}

std::vector<ViewPriors> true_priors(const Scene& scene) {
  std::vector<ViewPriors> out;
  for (const View& view : scene.views) {
    const int w = view.camera.width;
    const int h = view.camera.height;
    ViewPriors priors;
    priors.depth = test::true_depth(kPatches, view.camera);
    priors.sigma = DepthMap(w, h, 0.001f);
    priors.origin = Raster<DepthOrigin>(w, h, DepthOrigin::Measured);
    out.push_back(std::move(priors));
  }
  return out;
}

Scene photographs(const Water& water) {
  const std::vector<Camera> cameras = {test::looking_at({-0.5, 0, 0}, {0, 0, 6}, 160, 120, 150),
                                       test::looking_at({0.5, 0.1, 0}, {0, 0, 6}, 160, 120, 150),
                                       test::looking_at({0.2, 0.6, 1.8}, {0, 0, 6}, 160, 120, 150)};
  Scene scene = test::photographed_scene(kPatches, cameras, 0.15);
  for (View& view : scene.views) {
    view.image =
        through_water(view.image, view.camera, test::true_depth(kPatches, view.camera), water);
  }
  return scene;
}

TEST(WaterEvidence, HasRangesAndLightOfThePlace) {
  const Scene scene = photographs(Water());
  const std::vector<WaterMatch> matches = water_evidence(scene, true_priors(scene)).matches;
  ASSERT_GT(matches.size(), 2000u);
  size_t alike = 0;
  for (const WaterMatch& match : matches) {
    EXPECT_GT(match.range_a, 2);
    EXPECT_LT(match.range_a, 8);
    alike += (match.light_a - match.light_b).cwiseAbs().maxCoeff() < 0.03 ? 1 : 0;
  }
  EXPECT_GT(double(alike), 0.9 * double(matches.size()));
}

TEST(WaterEvidence, TellsTheWater) {
  const Scene scene = photographs(reef());
  const WaterEstimate found = estimate_water(scene, true_priors(scene));
  ASSERT_TRUE(found.water);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.water->attenuation[c] / reef().attenuation[c], 1, 0.1) << c;
    EXPECT_NEAR(found.water->backscatter[c] / reef().backscatter[c], 1, 0.2) << c;
    EXPECT_NEAR(found.water->veil[c], reef().veil[c], 0.02) << c;
  }
}

TEST(WaterEvidence, NeedsMeasuredDepth) {
  const Scene scene = photographs(reef());
  std::vector<ViewPriors> priors = true_priors(scene);
  for (DepthOrigin& origin : priors[1].origin.data) origin = DepthOrigin::Completed;
  const size_t all = water_evidence(scene, true_priors(scene)).matches.size();
  const size_t less = water_evidence(scene, priors).matches.size();
  EXPECT_LT(less, all);
  EXPECT_GT(less, 0u);
  for (DepthOrigin& origin : priors[0].origin.data) origin = DepthOrigin::Completed;
  EXPECT_TRUE(water_evidence(scene, priors).matches.empty());
}

TEST(WaterEvidence, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = photographs(reef());
  const auto with_threads = [&](size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return *estimate_water(scene, true_priors(scene)).water;
  };
  const Water one = with_threads(1);
  const Water four = with_threads(4);
  EXPECT_EQ(one.attenuation, four.attenuation);
  EXPECT_EQ(one.backscatter, four.backscatter);
  EXPECT_EQ(one.veil_sigma, four.veil_sigma);
}

TEST(TakeOutWater, ShowsTheSurfaceAndLeavesOpenWater) {
  Scene scene = photographs(reef());
  const Scene clear = photographs(Water());
  std::vector<ViewPriors> priors = true_priors(scene);
  for (int x = 0; x < 160; ++x) priors[0].origin(x, 0) = DepthOrigin::Sky;
  const ColorImage before = scene.views[0].image;
  take_out_water(priors, scene);
  EXPECT_EQ(scene.views[0].image.data, before.data) << "the scene states no water";
  scene.water = reef();
  take_out_water(priors, scene);
  for (int x = 0; x < 160; ++x) EXPECT_EQ(scene.views[0].image(x, 0), before(x, 0));
  for (int y = 1; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Vector3f off = scene.views[0].image(x, y) - clear.views[0].image(x, y);
      EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-3f);
    }
  }
}

}  // namespace
}  // namespace cgs::water_evidence_test
