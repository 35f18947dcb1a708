// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "tests/support/pane_scene.h"
#include "tests/support/stereo_scene.h"

namespace cgs::plane_sweep_test {
namespace {

using Eigen::Vector3d;
using test::TexturedPatch;

constexpr int kWidth = 96;
constexpr int kHeight = 72;
constexpr double kFocal = 90;
constexpr double kFinest = 0.05;  // texture cell, about one pixel at depth 4.5

std::vector<Camera> three_cameras() {
  std::vector<Camera> cameras;
  for (const double x : {-0.4, 0.0, 0.4}) {
    cameras.push_back(test::looking_at({x, 0.1 * x, 0}, {0.3 * x, 0, 4}, kWidth, kHeight, kFocal));
  }
  return cameras;
}

// For properties that do not depend on how well depth is refined.
PlaneSweepOptions one_round() { return {.refinement_rounds = 1}; }

std::vector<TexturedPatch> slanted_plane() {
  const Vector3d u = Vector3d(1, 0, 0.5).normalized();
  return {{Vector3d(0, 0, 4), u, Vector3d::UnitY(), 1e9, 1e9, 1}};
}

// A wall with a square in front of its middle.
std::vector<TexturedPatch> wall_and_square() {
  return {{Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY(), 1e9, 1e9, 1},
          {Vector3d(0, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 0.5, 0.5, 1}};
}

bool same_bits(const DepthMap& a, const DepthMap& b) {
  return a.data.size() == b.data.size() &&
         std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(float)) == 0;
}

// Share of the pixels of a view whose depth is measured within a relative error, of those that
// `counts` selects.
template <typename Counts>
double share_within(const ViewPriors& priors, const DepthMap& truth, double error, Counts counts) {
  double right = 0;
  double all = 0;
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      if (!counts(x, y)) continue;
      all += 1;
      right += std::abs(priors.depth(x, y) / truth(x, y) - 1) < error;
    }
  }
  return right / all;
}

TEST(PlaneSweep, MeasuresASlantedPlaneToATenthOfAPixel) {
  const auto patches = slanted_plane();
  const Scene scene = test::photographed_scene(patches, three_cameras(), kFinest);
  const std::vector<ViewPriors> priors = plane_sweep(scene, {});
  ASSERT_EQ(priors.size(), 3u);
  // dz / z = z / (f b) * dpx: at z <= 6.5, f = 90 and the wider baseline of at least 0.4, 0.1 px
  // is 1.8 %; at the centre 1.1 %.
  const DepthMap truth = test::true_depth(patches, scene.views[1].camera);
  const auto inner = [](int x, int y) {
    return x >= 6 && y >= 6 && x < kWidth - 6 && y < kHeight - 6;
  };
  EXPECT_GT(share_within(priors[1], truth, 0.018, inner), 0.98);
  EXPECT_GT(share_within(priors[1], truth, 0.011, inner), 0.90);
}

TEST(PlaneSweep, KeepsBothSidesOfAnOcclusionEdge) {
  const auto patches = wall_and_square();
  const Scene scene = test::photographed_scene(patches, three_cameras(), kFinest);
  const std::vector<ViewPriors> priors = plane_sweep(scene, {});
  const DepthMap truth = test::true_depth(patches, scene.views[1].camera);
  const auto seen = [&](int x, int y) {
    return x >= 6 && y >= 6 && x < kWidth - 6 && y < kHeight - 6 &&
           test::seen_elsewhere(patches, scene, 1, x, y, truth(x, y));
  };
  EXPECT_GT(share_within(priors[1], truth, 0.03, seen), 0.93);
}

// Where the pane shows as much contrast as what lies behind it, some depth is of neither.
double share_behind_pane(double contrast) {
  constexpr float kReflected = 0.4f;
  constexpr double kCell = 0.1;  // 1.5 pixels on the wall
  const test::PaneScene planted = test::pane_scene(three_cameras(), kCell, kReflected, contrast);
  const std::vector<ViewPriors> priors = plane_sweep(planted.scene, {});
  const Camera& camera = planted.scene.views[1].camera;
  const DepthMap truth = test::true_depth(planted.wall, camera);
  const DepthMap pane = test::true_depth(planted.both, camera);
  const auto behind = [&](int x, int y) { return pane(x, y) < truth(x, y) - 1; };
  return share_within(priors[1], truth, 0.03, behind);
}

TEST(PlaneSweep, MeasuresWhatLiesBehindAPane) {
  EXPECT_GT(share_behind_pane(0.5 * test::kFullContrast), 0.9);
  EXPECT_GT(share_behind_pane(test::kFullContrast), 0.55);
}

TEST(PlaneSweep, SigmaAndConfidenceTellTextureFromNone) {
  auto patches = slanted_plane();
  const Scene textured = test::photographed_scene(patches, three_cameras(), kFinest);
  patches[0].contrast = 0;
  const Scene plain = test::photographed_scene(patches, three_cameras(), kFinest);
  const auto mean_confidence = [](const Scene& scene) {
    const ViewPriors priors = plane_sweep(scene, {})[1];
    double sum = 0;
    for (const float c : priors.confidence.data) sum += c;
    return sum / double(priors.confidence.data.size());
  };
  EXPECT_GT(mean_confidence(textured), 0.6);
  EXPECT_LT(mean_confidence(plain), 0.05);
}

TEST(PlaneSweep, SigmaCoversTheErrors) {
  const auto patches = slanted_plane();
  const Scene scene = test::photographed_scene(patches, three_cameras(), kFinest);
  const std::vector<ViewPriors> priors = plane_sweep(scene, {});
  const DepthMap truth = test::true_depth(patches, scene.views[1].camera);
  int measured = 0;
  int within = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    if (priors[1].origin.data[i] != DepthOrigin::Measured) continue;
    ++measured;
    within += std::abs(priors[1].depth.data[i] - truth.data[i]) < 3 * priors[1].sigma.data[i];
  }
  EXPECT_GT(within, 0.95 * measured);
}

std::vector<Camera> two_cameras(double baseline) {
  return {test::looking_at({0, 0, 0}, {0, 0, 4}, kWidth, kHeight, kFocal),
          test::looking_at({baseline, 0, 0}, {baseline, 0, 4}, kWidth, kHeight, kFocal)};
}

// Of all that two cameras at a distance measure: sigma over depth.
std::vector<float> relative_sigma(double baseline) {
  const Scene scene = test::photographed_scene(slanted_plane(), two_cameras(baseline), kFinest);
  std::vector<float> out;
  for (const ViewPriors& view : plane_sweep(scene, one_round())) {
    for (size_t i = 0; i < view.sigma.data.size(); ++i) {
      if (view.origin.data[i] != DepthOrigin::Measured) continue;
      EXPECT_TRUE(std::isfinite(view.sigma.data[i])) << baseline;
      out.push_back(view.sigma.data[i] / view.depth.data[i]);
    }
  }
  return out;
}

// Disparities of 9 to 2 pixels at the middle of the plane: half of them tells half as well.
TEST(PlaneSweep, SigmaGrowsAsTheBaselineShrinks) {
  double last = 0;
  for (const double baseline : {0.4, 0.2, 0.1}) {
    std::vector<float> sigma = relative_sigma(baseline);
    ASSERT_GT(sigma.size(), size_t{kWidth} * kHeight / 2) << baseline;
    std::nth_element(sigma.begin(), sigma.begin() + std::ptrdiff_t(sigma.size() / 2), sigma.end());
    const auto median = double{sigma[sigma.size() / 2]};
    EXPECT_GT(median, 1.3 * last) << baseline;
    last = median;
  }
}

// A baseline of a hundredth of the distance and less moves nothing by a pixel and a half: where
// nothing can be measured nothing is claimed.
TEST(PlaneSweep, ClaimsNothingWhereTheBaselineIsTooShort) {
  for (const double baseline : {0.04, 0.004, 0.0004}) {
    EXPECT_TRUE(relative_sigma(baseline).empty()) << baseline;
  }
}

TEST(PlaneSweep, NeverReadsMaskedPixels) {
  Scene scene = test::photographed_scene(wall_and_square(), three_cameras(), kFinest);
  for (View& view : scene.views) {
    view.valid = MaskMap(kWidth, kHeight, 1);
    for (int y = 20; y < 50; ++y) {
      for (int x = 0; x < 40; ++x) view.valid(x, y) = 0;
    }
  }
  Scene poisoned = scene;
  for (View& view : poisoned.views) {
    for (size_t i = 0; i < view.image.data.size(); ++i) {
      if (view.valid.data[i] == 0) view.image.data[i].setConstant(std::nanf(""));
    }
  }
  const std::vector<ViewPriors> expected = plane_sweep(scene, one_round());
  const std::vector<ViewPriors> priors = plane_sweep(poisoned, one_round());
  for (size_t v = 0; v < priors.size(); ++v) {
    EXPECT_TRUE(same_bits(priors[v].depth, expected[v].depth));
    for (size_t i = 0; i < priors[v].depth.data.size(); ++i) {
      if (scene.views[v].valid.data[i] != 0) continue;
      ASSERT_TRUE(std::isnan(priors[v].depth.data[i]));
      ASSERT_EQ(priors[v].origin.data[i], DepthOrigin::Unknown);
    }
  }
}

TEST(PlaneSweep, DepthIsKnownExactlyWhereAnotherViewConfirmsIt) {
  const Scene scene = test::photographed_scene(wall_and_square(), three_cameras(), kFinest);
  for (const ViewPriors& p : plane_sweep(scene, one_round())) {
    for (size_t i = 0; i < p.depth.data.size(); ++i) {
      const bool measured = p.origin.data[i] == DepthOrigin::Measured;
      ASSERT_EQ(measured, p.matched_views.data[i] > 0);
      ASSERT_EQ(measured, p.depth.data[i] > 0);
      ASSERT_EQ(measured, p.sigma.data[i] > 0);
      ASSERT_LE(p.matched_views.data[i], 2);
    }
  }
}

TEST(PlaneSweep, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = test::photographed_scene(wall_and_square(), three_cameras(), kFinest);
  std::vector<std::vector<ViewPriors>> results;
  for (const size_t threads : {1u, 2u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(plane_sweep(scene, one_round()));
  }
  for (size_t v = 0; v < 3; ++v) {
    EXPECT_TRUE(same_bits(results[0][v].depth, results[1][v].depth));
    EXPECT_TRUE(same_bits(results[0][v].sigma, results[1][v].sigma));
  }
}

// An image that takes minutes must not keep who waits for its end from stopping it.
TEST(PlaneSweep, CanBeCancelledAmidAView) {
  const Scene scene = test::photographed_scene(wall_and_square(), three_cameras(), kFinest);
  std::vector<double> told;
  const auto priors =
      plane_sweep(scene, one_round(), [&](double fraction) { told.push_back(fraction); });
  ASSERT_FALSE(told.empty());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_LE(told.back(), 1);
  double before = 0;
  double largest_step = 0;
  for (const double fraction : told) {
    largest_step = std::max(largest_step, fraction - before);
    before = fraction;
  }
  // A view is a sixth, half of the whole being for the sweep; a thread that is kept from telling by
  // another one may leave out a part of that.
  EXPECT_LT(largest_step, 0.14);
  const auto expected = plane_sweep(scene, one_round());
  for (size_t v = 0; v < 3; ++v) EXPECT_TRUE(same_bits(priors[v].depth, expected[v].depth));
  const Progress cancel = [](double fraction) {
    if (fraction > 0.01) throw Cancelled();
  };
  EXPECT_THROW(plane_sweep(scene, one_round(), cancel), Cancelled);
}

TEST(PlaneSweep, StaysTheSameWhenTheSceneIsScaledByAPowerOfTwo) {
  Scene scene = test::photographed_scene(wall_and_square(), three_cameras(), kFinest);
  const std::vector<ViewPriors> expected = plane_sweep(scene, one_round());
  for (View& view : scene.views) {
    view.camera.world_from_cam.translation() *= 0x1p-20;
    view.near *= 0x1p-20;
    view.far *= 0x1p-20;
  }
  const std::vector<ViewPriors> priors = plane_sweep(scene, one_round());
  for (size_t i = 0; i < priors[0].depth.data.size(); ++i) {
    if (std::isnan(expected[0].depth.data[i])) continue;
    ASSERT_EQ(priors[0].depth.data[i], expected[0].depth.data[i] * 0x1p-20f);
  }
}

double measured_share(const ViewPriors& priors) {
  const auto& origin = priors.origin.data;
  return double(std::count(origin.begin(), origin.end(), DepthOrigin::Measured)) /
         double(origin.size());
}

TEST(PlaneSweep, MeasuresNothingOnPicturesOfOneColour) {
  for (const float level : {0.0f, 200 / 255.0f}) {
    for (const size_t views : {2u, 3u}) {
      std::vector<Camera> cameras = three_cameras();
      cameras.resize(views);
      Scene scene = test::photographed_scene(slanted_plane(), cameras, kFinest);
      for (View& view : scene.views) {
        for (Eigen::Vector3f& c : view.image.data) c.setConstant(level);
      }
      for (const ViewPriors& p : plane_sweep(scene, {})) EXPECT_EQ(measured_share(p), 0);
    }
  }
}

// Neighbours decide where a surface shows nothing, as long as they see it go on.
TEST(PlaneSweep, MeasuresABareSpotOfATexturedSurface) {
  std::vector<TexturedPatch> patches = {
      {Vector3d(0, 0, 4), Vector3d::UnitX(), Vector3d::UnitY(), 1e9, 1e9, 1},
      {Vector3d(0, 0, 3.9999), Vector3d::UnitX(), Vector3d::UnitY(), 0.25, 0.25, 0}};
  const Scene scene = test::photographed_scene(patches, three_cameras(), kFinest);
  const ViewPriors priors = plane_sweep(scene, {})[1];
  const DepthMap truth = test::true_depth(patches, scene.views[1].camera);
  const auto bare = [&](int x, int y) { return truth(x, y) < 3.99995f; };
  EXPECT_GT(share_within(priors, truth, 0.02, bare), 0.95);
}

// But a surface may bend where it shows nothing: here it lies deeper than the wall around it.
TEST(PlaneSweep, SigmaGrowsWithTheWayToWhatShowsSomething) {
  const Vector3d u = Vector3d::UnitX();
  const Vector3d v = Vector3d::UnitY();
  const std::vector<TexturedPatch> patches = {{Vector3d(0, 0, 4.15), u, v, 1e9, 1e9, 0},
                                              {Vector3d(-6, 0, 4), u, v, 5, 1e9, 1},
                                              {Vector3d(6, 0, 4), u, v, 5, 1e9, 1},
                                              {Vector3d(0, -5.75, 4), u, v, 1, 5, 1},
                                              {Vector3d(0, 5.75, 4), u, v, 1, 5, 1}};
  std::vector<Camera> cameras;
  for (const double x : {-0.4, 0.0, 0.4}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {0.3 * x, 0, 4}, 240, 180, 225));
  }
  const Scene scene = test::photographed_scene(patches, cameras, 0.02);
  const ViewPriors priors = plane_sweep(scene, {})[1];
  const DepthMap truth = test::true_depth(patches, scene.views[1].camera);
  int measured = 0;
  int within = 0;
  for (int y = 75; y < 105; ++y) {
    for (int x = 100; x < 140; ++x) {
      if (priors.origin(x, y) != DepthOrigin::Measured) continue;
      ++measured;
      within += std::abs(priors.depth(x, y) - truth(x, y)) < 3 * priors.sigma(x, y);
    }
  }
  ASSERT_GT(measured, 300);
  EXPECT_GT(within, 0.95 * measured);
}

// A half wall before a farther one. The first two cameras stand `baseline` apart; of the far wall
// they see a part that the third, far to the right, does not.
struct Corner {
  std::vector<TexturedPatch> patches;
  Scene scene;
  DepthMap truth;      // of the first view
  MaskMap pair_alone;  // where it shows what the third does not see
};

Corner corner(double baseline) {
  Corner c;
  c.patches = {{Vector3d(0, 0, 6), Vector3d::UnitX(), Vector3d::UnitY(), 1e9, 1e9, 1},
               {Vector3d(5, 0, 3), Vector3d::UnitX(), Vector3d::UnitY(), 5, 1e9, 1}};
  std::vector<Camera> cameras;
  for (const double x : {0.0, baseline, 1.5}) {
    cameras.push_back(test::looking_at({x, 0, 0}, {x, 0, 4}, kWidth, kHeight, kFocal));
  }
  c.scene = test::photographed_scene(c.patches, cameras, kFinest);
  // As the third camera does not see the far wall, what it shows is not what bounds it.
  for (View& view : c.scene.views) {
    view.near = 2;
    view.far = 12;
  }
  c.truth = test::true_depth(c.patches, cameras[0]);
  c.pair_alone = MaskMap(kWidth, kHeight, 0);
  Scene wide = c.scene;
  wide.views = {c.scene.views[0], c.scene.views[2]};
  for (int y = 0; y < kHeight; ++y) {
    // Windows next to the edge of the near wall see that wall.
    for (int x = 0; x < kWidth / 2 - 4; ++x) {
      c.pair_alone(x, y) = !test::seen_elsewhere(c.patches, wide, 0, x, y, c.truth(x, y));
    }
  }
  return c;
}

struct Judged {
  double pixels = 0;
  double measured = 0;  // share
  double within = 0;    // share of the measured, within three sigmas
};

Judged judged(const Corner& corner, const ViewPriors& priors) {
  Judged out;
  for (size_t i = 0; i < priors.depth.data.size(); ++i) {
    if (corner.pair_alone.data[i] == 0) continue;
    out.pixels += 1;
    if (priors.origin.data[i] != DepthOrigin::Measured) continue;
    out.measured += 1;
    out.within += std::abs(priors.depth.data[i] - corner.truth.data[i]) < 3 * priors.sigma.data[i];
  }
  out.within /= std::max(out.measured, 1.0);
  out.measured /= out.pixels;
  return out;
}

// The share of pixels that match somewhere though the only camera with parallax does not see them:
// as without a camera beside the first, but for three times the scatter of such a count.
double by_chance(Corner corner) {
  corner.scene.input = {0, 2};
  const Judged alone = judged(corner, plane_sweep(corner.scene, {})[0]);
  EXPECT_LT(alone.measured, 0.04);
  return alone.measured + 3 * std::sqrt(alone.measured / alone.pixels);
}

TEST(PlaneSweep, CamerasAtOnePlaceDoNotConfirmEachOther) {
  for (const double baseline : {0.0, 1e-9, 0.004, 0.01}) {
    const Corner c = corner(baseline);
    const std::vector<ViewPriors> priors = plane_sweep(c.scene, {});
    const Judged alone = judged(c, priors[0]);
    EXPECT_GT(alone.pixels, 0.3 * kWidth * kHeight);
    EXPECT_LT(alone.measured, by_chance(c)) << baseline;
    // What the third camera sees, too, is measured, with that view alone as witness.
    const auto near = [&](int x, int y) { return x > kWidth / 2 + 26 && c.truth(x, y) < 4; };
    EXPECT_GT(share_within(priors[0], c.truth, 0.01, near), 0.95) << baseline;
    EXPECT_EQ(
        *std::max_element(priors[0].matched_views.data.begin(), priors[0].matched_views.data.end()),
        1)
        << baseline;
  }
}

// Cameras nearly at one place tell little, and what they tell is as uncertain as said.
TEST(PlaneSweep, SigmaIsOfThePairThatConfirms) {
  for (const double baseline : {0.02, 0.03, 0.04, 0.05, 0.06}) {
    const Corner c = corner(baseline);
    EXPECT_LT(judged(c, plane_sweep(c.scene, {})[0]).measured, by_chance(c)) << baseline;
  }
  for (const double baseline : {0.1, 0.3}) {
    const Corner c = corner(baseline);
    const Judged alone = judged(c, plane_sweep(c.scene, {})[0]);
    EXPECT_GT(alone.measured, 0.3) << baseline;
    EXPECT_GT(alone.within, 0.97) << baseline;
  }
}

// What agrees with a photograph on every plane tells nothing of which is right.
TEST(PlaneSweep, ASecondShotFromOnePlaceTakesNothingAway) {
  const std::vector<TexturedPatch> patches = wall_and_square();
  const auto right = [&](const std::vector<double>& places) {
    std::vector<Camera> cameras;
    for (const double x : places) {
      cameras.push_back(
          test::looking_at({x, 0.1 * x, 0}, {0.3 * x, 0, 4}, kWidth, kHeight, kFocal));
    }
    const Scene scene = test::photographed_scene(patches, cameras, 0.1);
    const auto everywhere = [](int, int) { return true; };
    return share_within(
        plane_sweep(scene, {})[0], test::true_depth(patches, cameras[0]), 0.01, everywhere);
  };
  const double alone = right({-0.3, 0.3});
  EXPECT_GT(alone, 0.6);
  EXPECT_GT(right({-0.3, -0.3, 0.3}), alone - 0.05);
  EXPECT_GT(right({-0.3, -0.299, 0.3}), alone - 0.05);
}

// The last three photographs show a wall that the many before them, of another one, do not.
TEST(PlaneSweep, LooksAtEveryPhotographOfMany) {
  constexpr int kOthers = 18;
  const std::vector<TexturedPatch> patches = {
      {Vector3d(0, 0, 4), Vector3d::UnitX(), Vector3d::UnitY()},
      {Vector3d(0, 0, -4), Vector3d::UnitX(), Vector3d::UnitY()}};
  std::vector<Camera> cameras;
  for (int i = 0; i < kOthers; ++i) {
    const double x = 0.1 * i - 0.9;
    cameras.push_back(test::looking_at({x, 0, 0}, {0.3 * x, 0, -4}, 48, 36, 45));
  }
  for (const double x : {-0.4, 0.0, 0.4}) {
    cameras.push_back(test::looking_at({x, 0.1 * x, 0}, {0.3 * x, 0, 4}, 48, 36, 45));
  }
  Scene scene = test::photographed_scene(patches, cameras, 0.1);
  for (View& view : scene.views) {
    view.near = 3;
    view.far = 6;
  }
  const std::vector<ViewPriors> priors = plane_sweep(scene, one_round());
  const std::vector<DepthOrigin>& origin = priors[kOthers + 1].origin.data;
  const auto measured = std::count(origin.begin(), origin.end(), DepthOrigin::Measured);
  EXPECT_GT(double(measured), 0.9 * double(origin.size()));
}

TEST(PlaneSweep, MeasuresNothingOfOnePhotographOfManyThatShowsSomethingElse) {
  const std::vector<TexturedPatch> wall = {
      {Vector3d(0, 0, 4), Vector3d::UnitX(), Vector3d::UnitY()}};
  std::vector<Camera> cameras;
  for (int i = 0; i < 10; ++i) {
    const double x = 0.2 * i - 0.9;
    cameras.push_back(test::looking_at({x, 0.1 * x, 0}, {0.3 * x, 0, 4}, 48, 36, 45));
  }
  cameras.push_back(test::looking_at({100, 0, 0}, {100, 0, 4}, 48, 36, 45));
  Scene scene = test::photographed_scene(wall, cameras, 0.1);
  for (View& view : scene.views) {
    view.near = 3;
    view.far = 6;
  }
  const std::vector<ViewPriors> priors = plane_sweep(scene, one_round());
  const auto measured = [&](size_t view) {
    const std::vector<DepthOrigin>& origin = priors[view].origin.data;
    return std::count(origin.begin(), origin.end(), DepthOrigin::Measured);
  };
  EXPECT_EQ(measured(10), 0);
  EXPECT_GT(measured(5), 0.9 * 48 * 36);
}

// As a highlight that moves along with two photographs, and not with the others.
TEST(PlaneSweep, TakesNothingThatMoreViewsSeeThroughThanConfirm) {
  std::vector<Camera> cameras;
  for (const double x : {-0.5, -0.2, 0.2, 0.5}) {
    cameras.push_back(test::looking_at({x, 0.1 * x, 0}, {0, 0, 6}, kWidth, kHeight, kFocal));
  }
  const auto share_in_front = [&](size_t count) {
    const std::vector<Camera> used(cameras.begin(), cameras.begin() + std::ptrdiff_t(count));
    Scene scene = test::photographed_scene(wall_and_square(), used, kFinest);
    const Scene wall = test::photographed_scene({wall_and_square()[0]}, used, kFinest);
    for (size_t i = 2; i < count; ++i) scene.views[i].image = wall.views[i].image;
    const ViewPriors priors = plane_sweep(scene, {})[0];
    double out = 0;
    for (size_t i = 0; i < priors.depth.data.size(); ++i) {
      const bool is_measured = priors.origin.data[i] == DepthOrigin::Measured;
      out += is_measured && priors.depth.data[i] < 4.5f ? 1 : 0;
    }
    return out / double(priors.depth.data.size());
  };
  EXPECT_GT(share_in_front(3), 0.05) << "one for it, one against";
  EXPECT_LT(share_in_front(4), 0.005);
}

TEST(PlaneSweep, RefusesCamerasAtOnePlace) {
  std::vector<Camera> cameras = three_cameras();
  Scene scene = test::photographed_scene(slanted_plane(), cameras, kFinest);
  for (View& view : scene.views) {
    view.camera.world_from_cam.translation() *= 1e-9;
    view.camera.world_from_cam.translation().z() += 1;
  }
  EXPECT_THROW(plane_sweep(scene, one_round()), BadInput);
}

TEST(PlaneSweep, RefusesWhatItCannotMatch) {
  Scene scene = test::photographed_scene(slanted_plane(), three_cameras(), kFinest);
  Scene one = scene;
  one.input = {1};
  EXPECT_THROW(plane_sweep(one, one_round()), InvalidInput);
  scene.views[2].image = {};
  EXPECT_THROW(plane_sweep(scene, one_round()), InvalidInput);
}

TEST(PlaneSweepOptions, RefusesEachFieldOutOfRange) {
  EXPECT_NO_THROW(PlaneSweepOptions{}.validate());
  std::vector<PlaneSweepOptions> bad(9);
  bad[0].sampling.pixels_per_plane = 0;
  bad[1].sampling.max_planes = 7;
  bad[2].sampling.range_margin = std::nan("");
  bad[3].smoothness.small_step = -1;
  bad[4].smoothness.large_step = bad[4].smoothness.small_step - 1;
  bad[5].smoothness.edge_level = std::nanf("");
  bad[6].refinement_rounds = -1;
  bad[7].max_disagreement = 0;
  bad[8].least_disparity = 0;
  for (const PlaneSweepOptions& options : bad) EXPECT_THROW(options.validate(), InvalidInput);
}

}  // namespace
}  // namespace cgs::plane_sweep_test
