// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/grey_photographs.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "libcgs/core/photo_response.h"
#include "tests/support/colored_wall.h"

namespace cgs::grey_photographs_test {
namespace {

using Eigen::Vector3f;

ColorImage in_sepia(const ColorImage& image) {
  ColorImage out = in_grey(image);
  for (Vector3f& color : out.data) {
    const float l = color.x();
    const Vector3f toned(l + 0.2f * l * (1 - l), l, l - 0.25f * l * (1 - l));
    color = (255 * toned).array().round() / 255;
  }
  return out;
}

TEST(HasNoColors, TellsGreyAndSepiaFromColors) {
  const test::ColoredWall wall;
  const ColorImage& colored = wall.scene.views[0].image;
  EXPECT_FALSE(has_no_colors(colored, {}));
  EXPECT_TRUE(has_no_colors(in_grey(colored), {}));
  EXPECT_TRUE(has_no_colors(in_sepia(colored), {}));
  // Faint colours are colours.
  ColorImage faint = in_grey(colored);
  for (size_t i = 0; i < faint.data.size(); ++i) {
    faint.data[i] += 0.1f * (colored.data[i] - faint.data[i]);
  }
  EXPECT_FALSE(has_no_colors(faint, {}));
}

TEST(HasNoColors, LooksOnlyAtWhatMayBeUsed) {
  const test::ColoredWall wall;
  ColorImage image = in_grey(wall.scene.views[0].image);
  MaskMap valid(image.width, image.height, 1);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image(x, y) = wall.scene.views[0].image(x, y);
      valid(x, y) = 0;
    }
  }
  EXPECT_FALSE(has_no_colors(image, {}));
  EXPECT_TRUE(has_no_colors(image, valid));
  EXPECT_FALSE(has_no_colors(image, MaskMap(image.width, image.height, 0)));
}

TEST(MarkGreyPhotographs, MarksThoseAmongOthersWithColors) {
  Scene scene = test::ColoredWall().scene;
  EXPECT_FALSE(mark_grey_photographs(scene));
  scene.views[1].image = in_sepia(scene.views[1].image);
  EXPECT_TRUE(mark_grey_photographs(scene));
  EXPECT_TRUE(scene.views[1].response.is_grey);
  EXPECT_FALSE(scene.views[0].response.is_grey);
  for (const Vector3f& color : scene.views[1].image.data) EXPECT_EQ(color.x(), color.z());
}

// What all lack, none can tell; they stay as they are.
TEST(MarkGreyPhotographs, LeavesThoseAloneThatAreAllGrey) {
  Scene scene = test::ColoredWall().scene;
  for (View& view : scene.views) view.image = in_sepia(view.image);
  const ColorImage before = scene.views[0].image;
  EXPECT_FALSE(mark_grey_photographs(scene));
  EXPECT_EQ(scene.views[0].image.data, before.data);
  EXPECT_FALSE(has_grey_photographs(scene));
}

TEST(ColorGreyPhotographs, TakesColorsOfOthersAndSaysWhereThereAreNone) {
  test::ColoredWall wall;
  const ColorImage truth = wall.scene.views[0].image;
  wall.scene.views[0].image = in_grey(truth);
  ASSERT_TRUE(mark_grey_photographs(wall.scene));
  const ColorImage grey = wall.scene.views[0].image;
  const std::vector<MaskMap> unknown = color_grey_photographs(wall.scene, wall.priors);
  EXPECT_TRUE(unknown[1].empty());
  ASSERT_FALSE(unknown[0].empty());
  double of_grey = 0;
  double of_colored = 0;
  size_t known = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    const Vector3f& color = wall.scene.views[0].image.data[i];
    EXPECT_NEAR(coded_luminance(color), grey.data[i].x(), 2e-3);
    const int x = static_cast<int>(i) % 160;
    const int y = static_cast<int>(i) / 160;
    const double depth{wall.priors[0].depth.data[i]};
    const bool is_seen = test::seen_elsewhere(wall.patches, wall.scene, 0, x, y, depth);
    if (unknown[0].data[i] != 0) {
      EXPECT_EQ(color, grey.data[i]);
      // At rims, the pixel there may show what is before.
      continue;
    }
    ++known;
    EXPECT_TRUE(is_seen || depth > 2.9) << x << " " << y;
    of_grey += double{(grey.data[i] - truth.data[i]).cwiseAbs().mean()};
    of_colored += double{(color - truth.data[i]).cwiseAbs().mean()};
  }
  EXPECT_GT(double(known), 0.6 * double(truth.data.size()));
  EXPECT_LT(double(known), double(truth.data.size()));
  EXPECT_LT(of_colored, 0.35 * of_grey);
}

}  // namespace
}  // namespace cgs::grey_photographs_test
