// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scene_options.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::scene_options_test {
namespace {

TEST(SceneOptions, RefuseWhatIsOutOfRange) {
  EXPECT_NO_THROW(SceneOptions{}.validate());
  EXPECT_THROW(SceneOptions{.downscale = 0}.validate(), InvalidInput);
}

TEST(SceneOptions, WantAllOfFewAndADozenOfMany) {
  const SceneOptions options;
  for (const size_t few : {2u, 3u, 4u}) EXPECT_EQ(options.wanted_views(few), few);
  EXPECT_EQ(options.wanted_views(5), 4u);  // one in eight is held out, at least one
  EXPECT_EQ(options.wanted_views(8), 7u);
  EXPECT_EQ(options.wanted_views(9), 7u);
  EXPECT_EQ(options.wanted_views(13), 11u);
  EXPECT_EQ(options.wanted_views(200), 12u);
  EXPECT_EQ(SceneOptions{.all_views = true}.wanted_views(200), 200u);
  EXPECT_EQ(most_inputs(16), 14u);
}

}  // namespace
}  // namespace cgs::scene_options_test
