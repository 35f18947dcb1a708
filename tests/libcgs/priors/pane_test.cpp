// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/pane.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/priors/plane_sweep.h"
#include "tests/support/pane_scene.h"

namespace cgs::pane_test {
namespace {

constexpr double kCell = 0.06;  // 2.4 pixels on the wall
constexpr float kOpacity = 0.4f;

std::vector<Camera> cameras(size_t count) {
  std::vector<Camera> out;
  for (const double x : {-0.6, 0.0, 0.6}) {
    if (out.size() == count) break;
    out.push_back(test::looking_at({x, 0.15 * x * x, 0}, {0.5 * x, 0, 6}, 240, 180, 240));
  }
  return out;
}

std::optional<Pane> found(const Scene& scene, const std::vector<test::TexturedPatch>& surface) {
  std::vector<Camera> all;
  for (const View& view : scene.views) all.push_back(view.camera);
  return find_pane(scene, test::true_priors(surface, all));
}

double mean_square(const ColorImage& a, const ColorImage& b) {
  double sum = 0;
  for (size_t i = 0; i < a.data.size(); ++i) sum += double((a.data[i] - b.data[i]).squaredNorm());
  return sum / (3 * double(a.data.size()));
}

TEST(FindPane, TellsItFromWhatLiesBehind) {
  const test::PaneScene planted = test::pane_scene(cameras(3), kCell, kOpacity);
  const std::optional<Pane> pane = found(planted.scene, planted.wall);
  ASSERT_TRUE(pane.has_value());
  EXPECT_NEAR(pane->opacity, kOpacity, 0.05);
  EXPECT_GT(pane->gain, 3);
  const Camera& own = planted.scene.views[pane->drawn_from].camera;
  const DepthMap truth = test::true_depth(planted.both, own);
  double both = 0;
  double either = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    const bool is_there = truth.data[i] < 4;
    const bool is_found = pane->depth.data[i] > 0;
    both += is_there && is_found ? 1 : 0;
    either += is_there || is_found ? 1 : 0;
    if (is_there && is_found) EXPECT_NEAR(pane->depth.data[i] / truth.data[i], 1, 0.02);
  }
  EXPECT_GT(both / either, 0.85);
  ASSERT_EQ(pane->behind.size(), 3u);
  const Scene behind = behind_pane(planted.scene, *pane);
  for (size_t n = 0; n < 3; ++n) {
    const ColorImage& bare = planted.bare.views[n].image;
    EXPECT_LT(mean_square(behind.views[n].image, bare),
              0.2 * mean_square(planted.scene.views[n].image, bare))
        << n;
  }
}

// Share of the pixels of the middle view before the pane whose depth is measured within 2 %.
double share_measured(const std::vector<ViewPriors>& priors, const test::PaneScene& planted) {
  const Camera& camera = planted.scene.views[1].camera;
  const DepthMap wall = test::true_depth(planted.wall, camera);
  const DepthMap both = test::true_depth(planted.both, camera);
  double right = 0;
  double all = 0;
  for (size_t i = 0; i < wall.data.size(); ++i) {
    if (both.data[i] > 4) continue;
    all += 1;
    right += std::abs(priors[1].depth.data[i] / wall.data[i] - 1) < 0.02 ? 1 : 0;
  }
  return right / all;
}

TEST(FindPane, LetsTheSweepLookBehind) {
  const test::PaneScene planted = test::pane_scene(cameras(3), kCell, kOpacity);
  const std::vector<ViewPriors> before = plane_sweep(planted.scene, {});
  const std::optional<Pane> pane = find_pane(planted.scene, before);
  ASSERT_TRUE(pane.has_value());
  const std::vector<ViewPriors> after = plane_sweep(behind_pane(planted.scene, *pane), {});
  const double missed_before = 1 - share_measured(before, planted);
  const double missed_after = 1 - share_measured(after, planted);
  RecordProperty("before", std::to_string(missed_before));
  RecordProperty("after", std::to_string(missed_after));
  EXPECT_LT(missed_after, 0.02);
  EXPECT_LT(missed_after, 0.3 * missed_before);
}

TEST(FindPane, FindsNoneWhereNothingIsSeenThrough) {
  const test::PaneScene planted = test::pane_scene(cameras(3), kCell, 1);
  EXPECT_FALSE(found(planted.bare, planted.wall).has_value());
  EXPECT_FALSE(found(planted.scene, planted.both).has_value()) << "an opaque square";
}

TEST(FindPane, FindsNoneThatShowsNothingOfItsOwn) {
  const test::PaneScene planted = test::pane_scene(cameras(3), kCell, kOpacity, 0);
  EXPECT_FALSE(found(planted.scene, planted.wall).has_value());
}

TEST(FindPane, FindsNoneInTwoViews) {
  const test::PaneScene planted = test::pane_scene(cameras(2), kCell, kOpacity);
  EXPECT_FALSE(found(planted.scene, planted.wall).has_value());
}

TEST(FindPane, GivesTheSameBitsOnOneThread) {
  const test::PaneScene planted = test::pane_scene(cameras(3), kCell, kOpacity);
  const std::optional<Pane> all = found(planted.scene, planted.wall);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::optional<Pane> single = found(planted.scene, planted.wall);
  ASSERT_TRUE(all && single);
  EXPECT_EQ(all->opacity, single->opacity);
  EXPECT_EQ(all->gain, single->gain);
  EXPECT_EQ(all->color.data, single->color.data);
}

}  // namespace
}  // namespace cgs::pane_test
