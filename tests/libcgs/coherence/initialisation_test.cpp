// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/initialisation.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "libcgs/coherence/coherent_gaussians.h"
#include "libcgs/core/error.h"

namespace cgs::initialisation_test {
namespace {

Scene scene_of(size_t views) {
  Scene scene;
  for (size_t n = 0; n < views; ++n) {
    View view;
    view.camera = {.width = 6, .height = 4, .fx = 8, .fy = 8, .cx = 3, .cy = 2};
    view.camera.world_from_cam.translation() = Eigen::Vector3d(double(n), 0.5, -1);
    view.camera.world_from_cam.linear() =
        Eigen::AngleAxisd(0.1 * double(n), Eigen::Vector3d::UnitY()).toRotationMatrix();
    view.image = ColorImage(6, 4, Eigen::Vector3f(0.1f, 0.5f, 0.9f));
    scene.input.push_back(static_cast<int>(n));
    scene.views.push_back(view);
  }
  return scene;
}

std::vector<ViewPriors> priors_of(size_t views) {
  ViewPriors p;
  p.depth = DepthMap(6, 4, 2.0f);
  return std::vector<ViewPriors>(views, p);
}

TEST(InitialGaussians, ProjectToTheCentresOfTheirPixels) {
  const Scene scene = scene_of(2);
  const Gaussians gaussians = initial_gaussians(scene, priors_of(2));
  ASSERT_EQ(gaussians.size(), 48u);
  size_t i = 0;
  for (size_t n = 0; n < 2; ++n) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 6; ++x, ++i) {
        const Eigen::Vector3d uvz =
            scene.views[n].camera.project(gaussians.position[i].cast<double>());
        EXPECT_NEAR(uvz.x(), x + 0.5, 1e-5);
        EXPECT_NEAR(uvz.y(), y + 0.5, 1e-5);
        EXPECT_NEAR(uvz.z(), 2, 1e-6);
        // 0.6 pixels: 0.6 z / f
        EXPECT_FLOAT_EQ(gaussians.scale[i].x(), 0.15f);
      }
    }
  }
}

TEST(InitialGaussians, HaveTheColourOfTheirPixel) {
  const Gaussians gaussians = initial_gaussians(scene_of(2), priors_of(2));
  ASSERT_EQ(gaussians.sh_degree, 0);
  const Eigen::Vector3f color = kShC0 * gaussians.sh[7] + Eigen::Vector3f::Constant(0.5f);
  EXPECT_NEAR((color - Eigen::Vector3f(0.1f, 0.5f, 0.9f)).norm(), 0, 1e-6);
}

TEST(InitialGaussians, AreMoreTransparentTheMoreViewsDrawThem) {
  EXPECT_EQ(initial_gaussians(scene_of(2), priors_of(2)).opacity[0], 0.6f);
  EXPECT_EQ(initial_gaussians(scene_of(3), priors_of(3)).opacity[0], 0.5f);
  EXPECT_EQ(initial_gaussians(scene_of(4), priors_of(4)).opacity[0], 0.35f);
  EXPECT_EQ(initial_gaussians(scene_of(2), priors_of(2), {.opacity = 0.2f}).opacity[0], 0.2f);
}

TEST(InitialGaussians, SkipPixelsWithoutDepth) {
  std::vector<ViewPriors> priors = priors_of(2);
  priors[0].depth(2, 1) = std::numeric_limits<float>::quiet_NaN();
  priors[1].depth(0, 0) = std::numeric_limits<float>::infinity();
  EXPECT_EQ(initial_gaussians(scene_of(2), priors).size(), 46u);
}

TEST(InitialGaussians, SkipPixelsThatAnotherViewShowsFiner) {
  std::vector<ViewPriors> priors = priors_of(2);
  priors[1].shown_finer = MaskMap(6, 4, 0);
  priors[1].shown_finer(3, 2) = priors[1].shown_finer(4, 2) = 1;
  EXPECT_EQ(initial_gaussians(scene_of(2), priors).size(), 46u);
  for (ViewPriors& p : priors) p.layer = Raster<uint8_t>(6, 4, 0);
  CoherentGaussians model(scene_of(2), priors, {});
  EXPECT_EQ(model.range(1).last - model.range(1).first, 22u);
  EXPECT_EQ(model.pixel(1, 2 * 6 + 3), 2 * 6 + 5);
}

TEST(InitialGaussians, AreLabelledByWhatVouchesForTheirDepth) {
  std::vector<ViewPriors> priors = priors_of(2);
  for (ViewPriors& p : priors) {
    p.origin = Raster<DepthOrigin>(6, 4, DepthOrigin::Measured);
    p.matched_views = Raster<uint8_t>(6, 4, 1);
  }
  ViewPriors& second = priors[1];
  second.depth.data[0] = std::numeric_limits<float>::quiet_NaN();
  second.origin.data[0] = DepthOrigin::Unknown;
  second.matched_views.data[1] = 0;  // a depth sensor
  second.origin.data[2] = DepthOrigin::Completed;
  second.origin.data[3] = DepthOrigin::Guessed;
  second.origin.data[4] = DepthOrigin::Estimated;
  second.origin.data[5] = DepthOrigin::Sky;
  const Gaussians gaussians = initial_gaussians(scene_of(2), priors);
  std::vector<Provenance> expected(47, Provenance::Observed);
  for (const size_t i : {24, 25, 26}) expected[i] = Provenance::SingleView;
  for (const size_t i : {27, 28}) expected[i] = Provenance::Estimated;
  EXPECT_EQ(gaussians.size(), 47u);
  EXPECT_EQ(gaussians.provenance, expected);
}

TEST(InitialGaussians, HaveNoLabelsWhereAViewDoesNotSayHowItKnows) {
  std::vector<ViewPriors> priors = priors_of(2);
  EXPECT_TRUE(initial_gaussians(scene_of(2), priors).provenance.empty());
  priors[0].origin = Raster<DepthOrigin>(6, 4, DepthOrigin::Measured);
  priors[0].matched_views = Raster<uint8_t>(6, 4, 1);
  EXPECT_TRUE(initial_gaussians(scene_of(2), priors).provenance.empty());
}

TEST(InitialGaussians, RefusesPriorsThatDoNotFit) {
  EXPECT_THROW(initial_gaussians(scene_of(2), priors_of(3)), InvalidInput);
  std::vector<ViewPriors> priors = priors_of(2);
  priors[1].depth = DepthMap(5, 4, 1.0f);
  EXPECT_THROW(initial_gaussians(scene_of(2), priors), InvalidInput);
}

TEST(InitialisationOptions, RefusesEachFieldOutOfRange) {
  EXPECT_NO_THROW(InitialisationOptions{}.validate());
  EXPECT_THROW((InitialisationOptions{.radius_factor = 0}.validate()), InvalidInput);
  EXPECT_THROW((InitialisationOptions{.opacity = 1}.validate()), InvalidInput);
}

}  // namespace
}  // namespace cgs::initialisation_test
