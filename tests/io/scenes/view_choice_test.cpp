// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/view_choice.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"

namespace cgs::view_choice_test {
namespace {

using Indices = std::vector<int>;

/// Cameras side by side, one unit apart, which look at nothing that is known; v00, v01 …
Scene row(int count, int width = 80, int height = 60) {
  Scene out;
  out.kind = SceneKind::Colmap;
  for (int i = 0; i < count; ++i) {
    View view;
    view.name = (i < 10 ? "v0" : "v") + std::to_string(i);
    view.image_path = view.name + ".png";
    const double focal = 1.25 * width;
    view.camera = {
        width, height, focal, focal, width / 2.0, height / 2.0, Eigen::Isometry3d::Identity()};
    view.camera.world_from_cam.translation().x() = i;
    out.views.push_back(view);
  }
  return out;
}

Scene chosen(Scene scene, const SceneOptions& options = {}) {
  choose_views(scene, options);
  return scene;
}

TEST(ChooseViews, TakesAllOfUpToFour) {
  const Scene scene = chosen(row(4));
  EXPECT_EQ(scene.input, (Indices{0, 1, 2, 3}));
  EXPECT_TRUE(scene.held_out.empty());
}

TEST(ChooseViews, OfManyTakesThoseThatGoWellTogether) {
  const Scene scene = chosen(row(20));  // 44 degrees of view
  ASSERT_GT(scene.input.size(), 3u);
  for (size_t i = 1; i < scene.input.size(); ++i) {
    EXPECT_LE(scene.input[i] - scene.input[i - 1], 6);
  }
  EXPECT_GE(scene.held_out.size(), 3u);  // one in eight
  EXPECT_EQ(scene.input.size() + scene.held_out.size(), 20u);
}

TEST(ChooseViews, TakesEveryOneIfAsked) {
  const Scene scene = chosen(row(20), {.all_views = true});
  EXPECT_EQ(scene.input.size(), 20u);
  EXPECT_TRUE(scene.held_out.empty());
}

TEST(ChooseViews, OfLargeOnesTakesWhatSomeMinutesAllowAndSaysWhy) {
  const Scene scene = chosen(row(8, 1000, 750));
  EXPECT_EQ(scene.input.size(), 4u);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].rfind("4 of 8", 0), 0u) << scene.notes[0];
}

TEST(ChooseViews, OfHundredsHoldsOutSomeFromFirstToLast) {
  const Scene scene = chosen(row(200));
  EXPECT_GE(scene.input.size(), 3u);
  EXPECT_EQ(scene.held_out.size(), 24u);
  EXPECT_LE(scene.held_out.front(), 20);
  EXPECT_GE(scene.held_out.back(), 180);
  EXPECT_TRUE(std::is_sorted(scene.held_out.begin(), scene.held_out.end()));
}

TEST(ChooseViews, LeavesOutThoseWithoutAFile) {
  Scene scene = row(5);
  scene.views[1].image_path.clear();
  EXPECT_EQ(views_with_files(scene), (Indices{0, 2, 3, 4}));
  EXPECT_EQ(chosen(scene).input, (Indices{0, 2, 3, 4}));
  EXPECT_THROW(chosen(scene, {.views = "0,1"}), InvalidInput);
  for (size_t i = 1; i < 5; ++i) scene.views[i].image_path.clear();
  EXPECT_EQ(test::defect_of([&] { chosen(scene); }), "EMPTY");
}

TEST(ChooseViews, TakesNamesAndIndicesInAnyOrder) {
  EXPECT_EQ(chosen(row(6), {.views = "v03, 0,v05"}).input, (Indices{0, 3, 5}));
  EXPECT_EQ(chosen(row(6), {.views = "3,1"}).held_out, (Indices{0, 2, 4, 5}));
  EXPECT_EQ(chosen(row(6), {.views = "v01.png,2"}).input, (Indices{1, 2}));
}

TEST(ChooseViews, RefusesUnknownRepeatedAndSingleOnes) {
  for (const char* views : {"v03,v9", "0,6", "0,-1", "0,,1", "v00,0", "1,1", "2"}) {
    EXPECT_THROW(chosen(row(6), {.views = views}), InvalidInput) << views;
  }
  const std::string message = test::message_of([] { chosen(row(6), {.views = "0,nope"}); });
  EXPECT_NE(message.find("v00, v01"), std::string::npos) << message;
}

TEST(ChooseDivisors, OfManyLargeViewsMakesThemSmallerToTakeMore) {
  Scene many = row(20, 1000, 750);
  const Indices divisors = choose_divisors(many, {});
  EXPECT_EQ(divisors, Indices(20, 2));
  ASSERT_EQ(many.notes.size(), 1u);
  EXPECT_NE(many.notes[0].find("fewer of them would then be used"), std::string::npos);
  Scene all = row(20, 1000, 750);
  EXPECT_EQ(choose_divisors(all, {.all_views = true}), Indices(20, 1));
  EXPECT_TRUE(all.notes.empty());
}

TEST(ChooseDivisors, LeavesNoSideAboveTheLongest) {
  Scene few = row(3, 4032, 3024);
  EXPECT_EQ(choose_divisors(few, {}), Indices(3, 4));
  EXPECT_EQ(few.notes.size(), 1u);
}

}  // namespace
}  // namespace cgs::view_choice_test
