// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/estimate_priors.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/stereo_scene.h"

namespace cgs::estimate_priors_test {
namespace {

using Eigen::Vector3d;

Scene wall_and_square() {
  const std::vector<test::TexturedPatch> patches = {
      {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY()},
      {Vector3d(0, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 0.5, 0.5}};
  std::vector<Camera> cameras;
  for (const double x : {-0.25, 0.25}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 0, 4}, 80, 60, 75));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.06);
  to_canonical(scene);
  return scene;
}

TEST(EstimatePriors, GivesEveryPixelDepthSigmaAndLayer) {
  const Scene scene = wall_and_square();
  double last = 0;
  const EstimatedPriors priors = estimate_priors(scene, {}, [&](double done) {
    EXPECT_GE(done, last);
    last = done;
  });
  EXPECT_EQ(last, 1);
  ASSERT_EQ(priors.views.size(), 2u);
  for (size_t v = 0; v < 2; ++v) {
    const ViewPriors& p = priors.views[v];
    for (size_t i = 0; i < p.depth.data.size(); ++i) {
      ASSERT_TRUE(p.depth.data[i] > 0 && std::isfinite(p.depth.data[i]));
      ASSERT_TRUE(p.sigma.data[i] > 0 && std::isfinite(p.sigma.data[i]));
      ASSERT_LT(p.layer.data[i], 5);
    }
    EXPECT_GT(p.layer(40, 30), p.layer(5, 5));
    const PriorsCoverage& coverage = priors.report.coverage[v];
    EXPECT_GT(coverage.measured, 0.7);
    EXPECT_NEAR(coverage.measured + coverage.completed, 1, 1e-12);
  }
}

// The upper third of both photographs shows a blue sky.
TEST(EstimatePriors, TellsSharesThatAddUpToAllOfAView) {
  Scene scene = wall_and_square();
  for (View& view : scene.views) {
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 80; ++x) view.image(x, y) = Eigen::Vector3f(0.35f, 0.55f, 0.92f);
    }
    // What masks leave out is of no view.
    view.valid = MaskMap(80, 60, 1);
    for (int y = 0; y < 60; ++y) view.valid(0, y) = 0;
  }
  const EstimatedPriors priors = estimate_priors(scene, {});
  for (size_t v = 0; v < 2; ++v) {
    const PriorsCoverage& share = priors.report.coverage[v];
    EXPECT_NEAR(share.measured + share.completed + share.guessed + share.sky + share.transient +
                    share.left_open,
                1,
                1e-9);
    EXPECT_NEAR(share.sky, 1.0 / 3, 0.05);
    EXPECT_GT(share.measured, 0.3);
    EXPECT_LE(share.estimated, share.completed + share.guessed + 1e-9);
    const auto& origin = priors.views[v].origin.data;
    const auto estimated = std::count_if(origin.begin(), origin.end(), is_estimated);
    EXPECT_NEAR(share.estimated, double(estimated) / (79 * 60), 1e-9);
    EXPECT_EQ(priors.views[v].origin(40, 4), DepthOrigin::Sky);
    EXPECT_GT(priors.views[v].depth(40, 4), priors.views[v].depth(40, 30));
  }
}

void make_grey(View& view) {
  for (Eigen::Vector3f& c : view.image.data) c.setConstant(0.5f);
}

// Filled in, they would be a surface that nobody saw.
TEST(EstimatePriors, RefusesPhotographsOfWhichNothingCanBeMeasured) {
  Scene scene = wall_and_square();
  for (View& view : scene.views) make_grey(view);
  EXPECT_THROW(estimate_priors(scene, {}), NumericalError);
  for (View& view : scene.views) {
    view.valid = MaskMap(view.camera.width, view.camera.height, 0);
  }
  EXPECT_THROW(estimate_priors(scene, {}), InvalidInput);
}

TEST(EstimatePriors, LeavesOutTheViewOfWhichNothingCanBeMeasured) {
  Scene scene = wall_and_square();
  Scene three = scene;
  three.views.push_back(scene.views[0]);
  make_grey(three.views[2]);
  three.input = {0, 1, 2};
  const EstimatedPriors priors = estimate_priors(three, {});
  EXPECT_TRUE(is_measured(priors.report.coverage[0]));
  EXPECT_FALSE(is_measured(priors.report.coverage[2]));
  for (size_t i = 0; i < priors.views[2].depth.data.size(); ++i) {
    ASSERT_TRUE(std::isnan(priors.views[2].depth.data[i]));
    ASSERT_EQ(priors.views[2].origin.data[i], DepthOrigin::Unknown);
  }
}

}  // namespace
}  // namespace cgs::estimate_priors_test
