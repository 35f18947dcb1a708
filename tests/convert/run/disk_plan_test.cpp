// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/disk_plan.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/support/temp_dir.h"

namespace cgs::disk_plan_test {
namespace {

Scene two_views() {
  Scene scene;
  View view;
  view.camera.width = 1000;
  view.camera.height = 500;
  scene.views = {view, view};
  scene.input = {0, 1};
  return scene;
}

TEST(DiskPlan, GrowsWithThePixelsMostWithThoseOfInputViews) {
  Scene scene = two_views();
  const uint64_t both = disk_plan(scene);
  scene.input = {0};
  const uint64_t one = disk_plan(scene);
  EXPECT_LT(one, both);
  EXPECT_GT(one, both / 2);
  scene.held_out = {1};
  EXPECT_GT(disk_plan(scene), one);
  EXPECT_LT(disk_plan(scene), one + (both - one) / 2);
}

TEST(LittleRoomWarning, SaysHowMuchIsMissingOfWhatIsNotWrittenYet) {
  const Scene scene = two_views();
  const test::TempDir dir;
  const uint64_t need = disk_plan(scene);
  EXPECT_EQ(little_room_warning(scene, dir.path(), need), "");
  const std::string line = little_room_warning(scene, dir.path(), 20 << 20);
  EXPECT_NE(line.find("room for 20 MiB"), std::string::npos) << line;
  EXPECT_NE(line.find("about 360 MiB"), std::string::npos) << line;
  EXPECT_NE(little_room_warning(scene, dir.path(), need - 1), "");
  test::write_bytes(dir / "volume.vdb", std::string(1000, 'v'));
  EXPECT_EQ(little_room_warning(scene, dir.path(), need - 1000), "");
  EXPECT_NE(little_room_warning(scene, dir.path(), need - 1001), "");
}

TEST(LittleRoomWarning, AsksTheDisk) {
  Scene scene = two_views();
  const test::TempDir dir;
  EXPECT_EQ(little_room_warning(scene, dir.path()), "");
  scene.views[0].camera.width = 1 << 22;
  scene.views[0].camera.height = 1 << 22;
  EXPECT_NE(little_room_warning(scene, dir.path()), "");
  EXPECT_EQ(little_room_warning(scene, dir / "nowhere"), "");
}

}  // namespace
}  // namespace cgs::disk_plan_test
