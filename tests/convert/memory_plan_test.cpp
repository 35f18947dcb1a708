// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/memory_plan.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs {
namespace {

Scene scene_of(int views, int width, int height) {
  Scene scene;
  for (int i = 0; i < views; ++i) {
    View view;
    view.camera.width = width;
    view.camera.height = height;
    scene.views.push_back(view);
    scene.input.push_back(i);
  }
  return scene;
}

size_t most(const std::vector<StageMemory>& plan) {
  size_t out = 0;
  for (const StageMemory& stage : plan) out = std::max(out, stage.bytes);
  return out;
}

TEST(MemoryPlan, GrowsWithThePixelsOfTheInputViewsAlone) {
  const Scene scene = scene_of(3, 400, 300);
  Scene more = scene;
  more.views.resize(20);
  more.views.back().camera.width = 100000;
  EXPECT_EQ(memory_plan_text(memory_plan(more, true)), memory_plan_text(memory_plan(scene, true)));
  EXPECT_GT(most(memory_plan(scene_of(4, 400, 300), true)), most(memory_plan(scene, true)));
  EXPECT_GT(most(memory_plan(scene_of(3, 800, 600), true)), most(memory_plan(scene, true)));
}

TEST(MemoryPlan, LeavesOutWhatTheUsersVoxelsDecide) {
  const std::string text = memory_plan_text(memory_plan(scene_of(3, 400, 300), false));
  EXPECT_EQ(text.find("volume"), std::string::npos) << text;
  EXPECT_NE(text.find("depth and Gaussians"), std::string::npos) << text;
}

TEST(MemoryPlan, RefusesInOneLineThatSaysWhatToLower) {
  const auto plan = memory_plan(scene_of(3, 504, 378), true);
  EXPECT_NO_THROW(check_memory_plan(plan, most(plan)));
  try {
    check_memory_plan(plan, most(plan) / 5);
    FAIL() << "was accepted";
  } catch (const LimitError& error) {
    const std::string message = error.what();
    for (const char* word : {"volume and mesh", "--downscale 3", "--memory-limit"}) {
      EXPECT_NE(message.find(word), std::string::npos) << message;
    }
  }
}

}  // namespace
}  // namespace cgs
