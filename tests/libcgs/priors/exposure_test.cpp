// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/exposure.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/stereo_scene.h"

namespace cgs::exposure_of_priors_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// A wall and a square before it, which hides another part of the wall from each of three cameras.
const std::vector<test::TexturedPatch> kPatches = {
    {Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY()},
    {Vector3d(0, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 0.5, 0.5}};

Scene photographs() {
  std::vector<Camera> cameras;
  for (const double x : {-0.4, 0.0, 0.4}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 0, 4}, 160, 120, 150));
  }
  return test::photographed_scene(kPatches, cameras, 0.06);
}

std::vector<ViewPriors> true_priors(const Scene& scene) {
  std::vector<ViewPriors> out;
  for (const View& view : scene.views) {
    ViewPriors priors;
    priors.depth = test::true_depth(kPatches, view.camera);
    priors.origin = Raster<DepthOrigin>(160, 120, DepthOrigin::Measured);
    out.push_back(std::move(priors));
  }
  return out;
}

void expect_gain(const Vector3f& found, const Vector3f& expected) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 0.01) << c;
}

TEST(ExposureOfPriors, BringsTheOneThatStandsOutToTheOthers) {
  Scene scene = photographs();
  apply_gain(scene.views[1].image, {0.7f, 0.8f, 0.5f});
  const ExposureGains found = exposure_gains(scene, true_priors(scene));
  expect_gain(found.gain[0], Vector3f::Ones());
  expect_gain(found.gain[1], {1 / 0.7f, 1 / 0.8f, 1 / 0.5f});
  expect_gain(found.gain[2], Vector3f::Ones());
}

TEST(ExposureOfPriors, OfTwoViewsMeetInTheMiddle) {
  Scene scene = photographs();
  apply_gain(scene.views[2].image, Vector3f::Constant(0.64f));
  scene.input = {0, 2};
  std::vector<ViewPriors> priors = true_priors(scene);
  priors.erase(priors.begin() + 1);
  const ExposureGains found = exposure_gains(scene, priors);
  expect_gain(found.gain[0], Vector3f::Constant(0.8f));
  expect_gain(found.gain[1], Vector3f::Constant(1.25f));
}

// Two that share nothing with three others tell nothing of what these have in common.
TEST(ExposureOfPriors, IsSettledForEachGroupOfViewsByItself) {
  Scene scene = photographs();
  Scene beside = photographs();
  for (size_t i = 0; i < 2; ++i) {
    View& view = beside.views[i];
    view.camera.world_from_cam.pretranslate(Vector3d(0, 0, 100));
    apply_gain(view.image, Vector3f::Constant(i == 0 ? 0.5f : 0.125f));
    scene.views.push_back(view);
    scene.input.push_back(static_cast<int>(3 + i));
  }
  apply_gain(scene.views[0].image, Vector3f::Constant(0.8f));
  std::vector<ViewPriors> priors = true_priors(photographs());
  priors.push_back(priors[0]);
  priors.push_back(priors[1]);
  const ExposureGains found = exposure_gains(scene, priors);
  expect_gain(found.gain[0], Vector3f::Constant(1.25f));
  expect_gain(found.gain[1], Vector3f::Ones());
  expect_gain(found.gain[2], Vector3f::Ones());
  expect_gain(found.gain[3], Vector3f::Constant(0.5f));
  expect_gain(found.gain[4], Vector3f::Constant(2));
  EXPECT_EQ(found.group, (std::vector<size_t>{0, 0, 0, 3, 3}));
  EXPECT_NEAR(found.difference(), 3, 0.05);
  const ExposureGains apart{
      {Vector3f::Ones(), Vector3f::Constant(1.02f), Vector3f::Constant(0.98f)},
      {9, 9, 9},
      {0, 0, 2}};
  EXPECT_NEAR(apart.difference(), 0.02, 1e-6) << "nothing compares the third with the others";
}

TEST(ExposureOfPriors, CountsTheDifferenceOfTwoPhotographs) {
  Scene scene = photographs();
  scene.input = {0, 1};
  apply_gain(scene.views[1].image, Vector3f::Constant(1.045f));
  std::vector<ViewPriors> priors = true_priors(scene);
  priors.pop_back();
  const ExposureGains found = exposure_gains(scene, priors);
  expect_gain(found.gain[0], Vector3f::Constant(std::sqrt(1.045f)));
  EXPECT_NEAR(found.gain[0].x() / found.gain[1].x(), 1.045, 0.01);
}

TEST(ExposureOfPriors, LeavesPhotographsExposedAlikeAsTheyAre) {
  Scene scene = photographs();
  apply_gain(scene.views[1].image, Vector3f::Constant(1.015f));
  for (const Vector3f& gain : exposure_gains(scene, true_priors(scene)).gain) {
    EXPECT_EQ(gain, Vector3f::Ones());
  }
}

// What was filled in lies where no other view confirms it, and may show anything there.
TEST(ExposureOfPriors, HeedsMeasuredDepthAlone) {
  Scene scene = photographs();
  apply_gain(scene.views[1].image, Vector3f::Constant(0.5f));
  std::vector<ViewPriors> priors = true_priors(scene);
  for (DepthOrigin& origin : priors[1].origin.data) origin = DepthOrigin::Completed;
  const ExposureGains found = exposure_gains(scene, priors);
  EXPECT_EQ(found.gain[1], Vector3f::Ones());
  EXPECT_EQ(found.samples[1], 0u);
  priors.pop_back();
  EXPECT_THROW(exposure_gains(scene, priors), InvalidInput);
}

}  // namespace
}  // namespace cgs::exposure_of_priors_test
