// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/readable_inputs.h"

#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/grey_model.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::readable_inputs_test {
namespace {

constexpr size_t kMuch = size_t{1} << 30;
constexpr size_t kLittle = 1;

TEST(RefuseUnreadable, TellsTheFirstDamagedPhotographHoweverManyAreReadAtOnce) {
  const test::TempDir dir;
  Scene scene = test::model_of_greys(dir, 5).scene;
  scene.input = {0, 2};
  scene.held_out = {4};
  for (const size_t room : {kMuch, kLittle}) {
    EXPECT_NO_THROW(refuse_unreadable(scene, room, {}));
  }
  for (const char* name : {"3.png", "1.png"}) test::write_bytes(dir / name, "no picture");
  for (const size_t room : {kMuch, kLittle}) {
    const std::string told = test::message_of([&] { refuse_unreadable(scene, room, {}); });
    EXPECT_NE(told.find("1.png"), std::string::npos) << told;
  }
}

TEST(RefuseUnreadable, TellsHowFarItIsAndCanBeStopped) {
  const test::TempDir dir;
  const Scene scene = test::model_of_greys(dir, 3).scene;
  std::vector<double> told;
  refuse_unreadable(scene, kLittle, [&](double fraction) { told.push_back(fraction); });
  EXPECT_EQ(told, (std::vector<double>{0, 1.0 / 3, 2.0 / 3, 1}));
  EXPECT_THROW(refuse_unreadable(scene, kLittle, [](double) { throw Cancelled(); }), Cancelled);
}

}  // namespace
}  // namespace cgs::readable_inputs_test
