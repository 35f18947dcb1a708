// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/view_groups.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/stereo_scene.h"

namespace cgs::view_groups_test {
namespace {

// Cameras a metre apart along a wall five metres away, in an order that says nothing of it.
Scene along_a_wall(int count) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    const double x = i * 7 % count;
    View view;
    view.name = "v" + std::to_string(i);
    view.camera = test::looking_at({x, 0, -5}, {x, 0, 0}, 80, 60, 60);
    view.near = 4;
    view.far = 6;
    scene.views.push_back(view);
    scene.input.push_back(i);
  }
  return scene;
}

double place_of(const Scene& scene, int view) {
  return scene.views[static_cast<size_t>(view)].camera.center().x();
}

TEST(GroupViews, LeavesTogetherWhatFits) {
  const std::vector<ViewGroup> groups = group_views(along_a_wall(25), 25);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].own, groups[0].all);
  EXPECT_EQ(groups[0].own.size(), 25u);
}

TEST(GroupViews, GivesEachViewToOneGroupThatIsNoLargerThanAsked) {
  const Scene scene = along_a_wall(25);
  std::map<int, int> owners;
  const std::vector<ViewGroup> groups = group_views(scene, 10);
  EXPECT_EQ(groups.size(), 4u);
  for (const ViewGroup& group : groups) {
    EXPECT_LE(group.all.size(), 10u);
    EXPECT_TRUE(std::is_sorted(group.all.begin(), group.all.end()));
    EXPECT_TRUE(
        std::includes(group.all.begin(), group.all.end(), group.own.begin(), group.own.end()));
    for (const int i : group.own) ++owners[i];
  }
  EXPECT_EQ(owners.size(), 25u);
  for (const auto& [view, count] : owners) EXPECT_EQ(count, 1) << view;
}

// Along the wall a group is one stretch of it, and those it borrows stand beside it.
TEST(GroupViews, KeepsTogetherWhoStandTogether) {
  const Scene scene = along_a_wall(25);
  for (const ViewGroup& group : group_views(scene, 10)) {
    std::vector<double> own;
    for (const int i : group.own) own.push_back(place_of(scene, i));
    std::sort(own.begin(), own.end());
    EXPECT_EQ(own.back() - own.front(), static_cast<double>(own.size() - 1));
    EXPECT_GT(group.all.size(), group.own.size());
    for (const int i : group.all) {
      EXPECT_GE(place_of(scene, i), own.front() - 4);
      EXPECT_LE(place_of(scene, i), own.back() + 4);
    }
  }
}

TEST(GroupViews, RefusesGroupsThatMeasureNothing) {
  EXPECT_THROW(group_views(along_a_wall(5), 2), InvalidInput);
}

}  // namespace
}  // namespace cgs::view_groups_test
