// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/guessed_depth.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include <gtest/gtest.h>

#include "libcgs/priors/estimate_priors.h"
#include "tests/support/stereo_scene.h"

namespace cgs::guessed_depth_test {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 120;
constexpr int kHeight = 90;

/// A textured floor and back wall, and before them a slanted board without texture that fills the
/// middle of the pictures: only its rim can be matched.
std::vector<test::TexturedPatch> blank_board() {
  const Vector3d across = Vector3d(1, 0, 0.7).normalized();
  return {{Vector3d(0, 0, 7), Vector3d::UnitX(), Vector3d::UnitY()},
          {Vector3d(0, 1.2, 5), Vector3d::UnitX(), Vector3d::UnitZ()},
          {Vector3d(0, 0, 4), across, Vector3d::UnitY(), 1.1, 0.9, 0}};
}

Scene board_scene(int views) {
  std::vector<Camera> cameras;
  for (int i = 0; i < views; ++i) {
    const double x = views == 2 ? 0.5 * i - 0.25 : 0.35 * (i - 1);
    cameras.push_back(test::looking_at({x, 0, 0}, {0, 0, 4.5}, kWidth, kHeight, 110));
  }
  Scene scene = test::photographed_scene(blank_board(), cameras, 0.06);
  to_canonical(scene);
  return scene;
}

DepthMap truth_of(const Scene& scene, size_t view) {
  Camera camera = scene.views[view].camera;
  camera.world_from_cam = world_from_internal(scene.frame, camera.world_from_cam);
  return test::true_depth(blank_board(), camera);
}

/// Gives every view f(true depth, view, x, y).
void give(Scene& scene, const std::function<double(double, size_t, int, int)>& f) {
  for (size_t k = 0; k < scene.views.size(); ++k) {
    DepthMap given = truth_of(scene, k);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        given(x, y) = static_cast<float>(f(double(given(x, y)), k, x, y));
      }
    }
    scene.views[k].given_depth = std::move(given);
  }
}

struct Errors {
  double measured_mean = 0;  // relative
  double other_mean = 0;
  double other_95 = 0;
  double within_two_sigma = 0;  // share of guessed pixels
  size_t guessed = 0;
};

// Against the truth, split by what the photographs alone measure.
Errors errors_of(const Scene& scene, const EstimatedPriors& alone, const EstimatedPriors& priors) {
  Errors out;
  std::vector<double> measured;
  std::vector<double> other;
  double honest = 0;
  for (size_t k = 0; k < scene.views.size(); ++k) {
    const DepthMap truth = truth_of(scene, k);
    for (size_t i = 0; i < truth.data.size(); ++i) {
      const double z = double(priors.views[k].depth.data[i]) * scene.frame.scale;
      const double error = std::abs(z / double(truth.data[i]) - 1);
      const bool is_measured = alone.views[k].origin.data[i] == DepthOrigin::Measured;
      (is_measured ? measured : other).push_back(error);
      if (priors.views[k].origin.data[i] != DepthOrigin::Guessed) continue;
      ++out.guessed;
      const double sigma = double(priors.views[k].sigma.data[i] / priors.views[k].depth.data[i]);
      honest += error < 2 * sigma ? 1 : 0;
    }
  }
  const auto mean = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / double(std::max(size_t{1}, values.size()));
  };
  out.measured_mean = mean(measured);
  out.other_mean = mean(other);
  std::sort(other.begin(), other.end());
  out.other_95 = other[other.size() * 95 / 100];
  out.within_two_sigma = out.guessed > 0 ? honest / double(out.guessed) : 1;
  return out;
}

// As estimate_priors(), but that what was guessed can still be told from what was completed.
EstimatedPriors priors_with_origins(const Scene& scene) {
  constexpr float kAnyWay = 1e9f;
  PriorsOptions options;
  options.adjoining = {.way = kAnyWay, .largest_step = kAnyWay};
  return estimate_priors(scene, options);
}

class GuessedDepth : public testing::TestWithParam<int> {
 protected:
  GuessedDepth() : scene_(board_scene(GetParam())), alone_(priors_with_origins(scene_)) {
    before_ = errors_of(scene_, alone_, alone_);
    EXPECT_GT(before_.other_mean, 0.01) << "the scene must be hard enough to tell anything";
  }
  Errors with_given() {
    given_ = priors_with_origins(scene_);
    const Errors after = errors_of(scene_, alone_, given_);
    for (size_t k = 0; k < given_.views.size(); ++k) {
      const ViewPriors& a = alone_.views[k];
      const ViewPriors& b = given_.views[k];
      for (size_t i = 0; i < a.depth.data.size(); ++i) {
        if (a.origin.data[i] != DepthOrigin::Measured) continue;
        EXPECT_EQ(a.depth.data[i], b.depth.data[i]) << "what two views agree on must stay";
        EXPECT_EQ(b.origin.data[i], DepthOrigin::Measured);
      }
    }
    std::printf("not measured: mean error %.4f -> %.4f, 95 %% below %.4f -> %.4f; %zu guessed\n",
                before_.other_mean,
                after.other_mean,
                before_.other_95,
                after.other_95,
                after.guessed);
    return after;
  }
  Scene scene_;
  EstimatedPriors alone_;
  EstimatedPriors given_;
  Errors before_;
};

TEST_P(GuessedDepth, TrueDisparityOfUnknownScaleFindsTheBlankBoard) {
  give(scene_, [](double z, size_t k, int, int) { return (20.0 + 7 * double(k)) / z - 1.5; });
  const Errors after = with_given();
  EXPECT_EQ(given_.report.given.kind, DepthKind::Disparity);
  EXPECT_LT(after.other_mean, 0.4 * before_.other_mean);
  EXPECT_GT(after.guessed, 500u);
  EXPECT_GT(after.within_two_sigma, 0.9);
}

TEST_P(GuessedDepth, BentDepthStillHelps) {
  // As networks err: waves of a few percent, one per view.
  give(scene_, [](double z, size_t k, int x, int y) {
    const double wave = std::sin(0.05 * x + double(k)) * std::cos(0.04 * y);
    return 12.0 / (z * (1 + 0.04 * wave)) + 0.3 * double(k);
  });
  const Errors after = with_given();
  EXPECT_LT(after.other_mean, 0.8 * before_.other_mean);
  EXPECT_GT(after.within_two_sigma, 0.8);
}

TEST_P(GuessedDepth, CorruptedDepthDoesNoHarm) {
  // A different scale and offset per view, bumps of 20 %, a block whose order is inverted,
  // outliers.
  give(scene_, [](double z, size_t k, int x, int y) {
    const double d = (6.0 + double(k)) / z + 0.4 * double(k);
    const auto bump = [&](int cx, int cy, double height) {
      const double r2 = (x - cx) * (x - cx) + (y - cy) * (y - cy);
      return height * std::exp(-r2 / 120);
    };
    const int shift = 9 * static_cast<int>(k);
    const double bumps = bump(30 + shift, 30, 0.2) + bump(80 - shift, 50, -0.2) + bump(60, 70, 0.2);
    const bool inverted = x > 50 + shift && x < 65 + shift && y > 35 && y < 50;
    const bool wild = (x * 7919 + y * 104729) % 23 == 0;
    return wild ? 0.1 + (x * y) % 5 : inverted ? 3 - d * (1 + bumps) : d * (1 + bumps);
  });
  const Errors after = with_given();
  EXPECT_LT(after.other_mean, 1.05 * before_.other_mean);
  EXPECT_LT(after.other_95, 1.1 * before_.other_95);
}

TEST_P(GuessedDepth, NoiseIsLeftOut) {
  give(scene_, [](double, size_t, int x, int y) { return 1.0 + (x * 7919 + y * 104729) % 97; });
  const Errors after = with_given();
  EXPECT_EQ(after.guessed, 0u);
  EXPECT_EQ(after.other_mean, before_.other_mean);
}

INSTANTIATE_TEST_SUITE_P(Views, GuessedDepth, testing::Values(2, 3));

TEST(RemoveContradictions, TakesOutWhatFloatsBeforeOtherViews) {
  const float nan = std::nanf("");
  View view;
  view.camera = {.width = 60, .height = 20, .fx = 60, .fy = 60, .cx = 30, .cy = 10};
  Scene scene;
  scene.views.assign(2, view);
  scene.views[1].camera.world_from_cam.translation().x() = 0.5;
  scene.input = {0, 1};
  ViewPriors none{DepthMap(60, 20, nan),
                  DepthMap(60, 20, nan),
                  Raster<float>(60, 20, 0.0f),
                  Raster<DepthOrigin>(60, 20, DepthOrigin::Unknown),
                  Raster<uint8_t>(60, 20, 0),
                  Raster<uint8_t>(60, 20, 0)};
  std::vector<ViewPriors> priors(2, none);
  // The second view measures a wall at depth 5 in its right half.
  for (int y = 0; y < 20; ++y) {
    for (int x = 30; x < 60; ++x) {
      priors[1].depth(x, y) = 5;
      priors[1].sigma(x, y) = 0.01f;
      priors[1].origin(x, y) = DepthOrigin::Measured;
    }
  }
  std::vector<DepthGuess> guesses(2, {DepthMap(60, 20, nan), DepthMap(60, 20, nan)});
  const auto guess = [&](size_t view, int x, float depth) {
    guesses[view].depth(x, 10) = depth;
    guesses[view].sigma(x, 10) = 0.01f * depth;
  };
  guess(0, 50, 5);  // lands at x = 50 - 0.5 * 60 / 5 = 44: agrees
  guess(0, 59, 3);  // lands at 49, before the wall
  guess(0, 58, 7);  // lands at 53, behind the wall: hidden, nobody objects
  guess(0, 20, 3);  // lands at 10, where the other view
  guess(1, 10, 6);  // guesses that nothing stands
  guess(0, 25, 3);  // lands where nothing is known
  // The given depth of the second view contradicts what it measured at one pixel.
  std::vector<FittedDepth> fitted(2);
  fitted[1] = {DepthMap(60, 20, 5), 0.01};
  fitted[1].depth(48, 10) = 4;
  guess(0, 57, 3.3f);  // lands there, at 48
  remove_contradictions(scene, fitted, priors, guesses);
  EXPECT_EQ(guesses[0].depth(57, 10), 3.3f);
  EXPECT_EQ(guesses[0].depth(50, 10), 5);
  EXPECT_TRUE(std::isnan(guesses[0].depth(59, 10)));
  EXPECT_TRUE(std::isnan(guesses[0].sigma(59, 10)));
  EXPECT_EQ(guesses[0].depth(58, 10), 7);
  EXPECT_TRUE(std::isnan(guesses[0].depth(20, 10)));
  EXPECT_TRUE(std::isnan(guesses[1].depth(10, 10)));
  EXPECT_EQ(guesses[0].depth(25, 10), 3);
}

}  // namespace
}  // namespace cgs::guessed_depth_test
