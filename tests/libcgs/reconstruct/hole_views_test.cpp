// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/hole_views.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/panel_model.h"

namespace cgs::hole_views_test {
namespace {

TEST(HoleViews, AreFewAndSeeNearlyAllThatIsOpen) {
  const Model model = test::panel_model();
  const HoleViews found = hole_views(model);
  ASSERT_FALSE(found.cameras.empty());
  EXPECT_LE(found.cameras.size(), 6u);
  EXPECT_GT(found.candidates, 10u);
  const bool is_enough = found.covered >= 0.95 || found.cameras.size() == 6;
  EXPECT_TRUE(is_enough) << found.covered;
  EXPECT_GT(found.covered, 0.6);
  // Both sides of what the panel hides are seen: from the left and from the right.
  const auto x = [](const Camera& camera) { return camera.center().x(); };
  const auto [least, most] = std::minmax_element(
      found.cameras.begin(), found.cameras.end(), [&](const Camera& a, const Camera& b) {
        return x(a) < x(b);
      });
  EXPECT_LT(x(*least), -0.3);
  EXPECT_GT(x(*most), 0.3);
}

TEST(HoleViews, LooksFromViewsHeldOut) {
  Model model = test::panel_model();
  View view;
  view.name = "held out";
  view.camera = test::panel_camera(0);
  view.camera.world_from_cam.rotate(Eigen::AngleAxisd(2.2, Eigen::Vector3d::UnitY()));
  model.scene.held_out.push_back(static_cast<int>(model.scene.views.size()));
  model.scene.views.push_back(view);
  const HoleViews with = hole_views(model);
  model.scene.held_out.clear();
  EXPECT_EQ(with.candidates, hole_views(model).candidates + 1);
}

// What stays open all the same is not looked for.
TEST(HoleViews, AreOfWhatWillBeFilled) {
  const Model model = test::panel_model();
  const auto all = [](const ViewToPaint& view) { return view.open; };
  EXPECT_TRUE(hole_views(model, all).cameras.empty());
  const auto from_the_left = [](const ViewToPaint& view) {
    const bool is_left = view.camera.center().x() < 0;
    return is_left ? view.open : MaskMap(view.open.width, view.open.height, 0);
  };
  const HoleViews found = hole_views(model, from_the_left);
  ASSERT_FALSE(found.cameras.empty());
  for (const Camera& camera : found.cameras) EXPECT_GE(camera.center().x(), 0);
}

TEST(HoleViews, NeedInputViews) {
  Model bare = test::panel_model();
  bare.priors.clear();
  EXPECT_THROW(hole_views(bare), InvalidInput);
}

}  // namespace
}  // namespace cgs::hole_views_test
