// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/view_sizes.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::view_sizes_test {
namespace {

using Divisors = std::vector<int>;

Scene scene_of(const std::vector<std::array<int, 2>>& sizes) {
  Scene out;
  for (const auto& [width, height] : sizes) {
    View& view = out.views.emplace_back();
    view.name = "v" + std::to_string(out.views.size());
    view.image_path = "/scene/" + view.name + ".jpg";
    view.camera.width = width;
    view.camera.height = height;
    view.camera.fx = view.camera.fy = width;
    view.camera.cx = 0.5 * width;
    view.camera.cy = 0.5 * height;
  }
  return out;
}

TEST(ViewSizes, HaveTheSameShapeWhereOneIsTheOtherRounded) {
  EXPECT_TRUE(have_same_shape(4032, 3024, 504, 378));
  EXPECT_TRUE(have_same_shape(1000, 667, 500, 333));
  EXPECT_FALSE(have_same_shape(4032, 3024, 378, 504));
  EXPECT_FALSE(have_same_shape(1920, 1080, 1920, 1440));
}

TEST(ViewSizes, AreDividedSoThatTheLargestSideEndsInMinutes) {
  const Scene small = scene_of({{1024, 768}, {800, 600}});
  EXPECT_EQ(divisors_to(small, 1024), (Divisors{1, 1}));
  EXPECT_EQ(divisors_text(small, {1, 1}), "");
  const Scene large = scene_of({{768, 1025}, {4032, 3024}, {4000, 3000}});
  EXPECT_EQ(divisors_to(large, 1024), (Divisors{2, 4, 4}));
  EXPECT_EQ(divisors_to(large, 800), (Divisors{2, 6, 6}));
  const std::string text = divisors_text(large, {2, 4, 4});
  EXPECT_NE(text.find("4032 x 3024 pixels are worked on at 1/4"), std::string::npos);
  EXPECT_NE(text.find("smaller ones at more"), std::string::npos);
}

TEST(ViewSizes, LeavePhotographsOfAlmostTheSameSizeAlike) {
  EXPECT_EQ(divisors_to(scene_of({{4032, 3024}, {3000, 2250}}), 1024), (Divisors{4, 4}));
}

TEST(ViewSizes, AreRoundedDownAndNeverNothing) {
  Scene scene = scene_of({{101, 75}});
  divide_sizes(scene, {2});
  EXPECT_EQ(scene.views[0].camera.width, 50);
  EXPECT_EQ(scene.views[0].camera.height, 37);
  EXPECT_THROW(divide_sizes(scene, {10}), InvalidInput);
}

}  // namespace
}  // namespace cgs::view_sizes_test
