// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/photo_quality.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/srgb.h"

namespace cgs::photo_quality_test {
namespace {

using Eigen::Vector3f;

// Blocks of five pixels, each of a grey of its own.
ColorImage blocks(int width, int height) {
  ColorImage out(width, height, Vector3f::Zero());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const unsigned hash = (unsigned(x / 5) * 73856093U ^ unsigned(y / 5) * 19349663U) % 97U;
      out(x, y).setConstant(0.2f + 0.6f * static_cast<float>(hash) / 97);
    }
  }
  return out;
}

// The mean of so many pixels to each side along rows, as of a camera that moved.
ColorImage shaken(const ColorImage& image, int reach) {
  ColorImage out = image;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      Vector3f sum = Vector3f::Zero();
      for (int d = -reach; d <= reach; ++d) {
        sum += image(std::clamp(x + d, 0, image.width - 1), y);
      }
      out(x, y) = sum / static_cast<float>(2 * reach + 1);
    }
  }
  return out;
}

TEST(BlurEffect, GrowsWithTheBlurThoughItIsAlongOneDirection) {
  const ColorImage sharp = blocks(120, 90);
  double before = blur_effect(sharp);
  EXPECT_LT(before, 0.4);
  for (const int reach : {1, 3, 6}) {
    const double now = blur_effect(shaken(sharp, reach));
    EXPECT_GT(now, before + 0.05) << reach;
    before = now;
  }
  EXPECT_GT(before, 0.6);
  EXPECT_LE(before, 1);
}

// A row that steps from 0 to 1: of the one difference of 1, a mean over nine leaves a ninth.
TEST(BlurEffect, IsWhatItsAuthorsDefine) {
  ColorImage step(20, 4, Vector3f::Zero());
  for (int y = 0; y < 4; ++y) {
    for (int x = 10; x < 20; ++x) step(x, y).setOnes();
  }
  EXPECT_NEAR(blur_effect(step), 1.0 / 9, 1e-6);
  EXPECT_EQ(blur_effect(ColorImage(20, 4, Vector3f::Ones())), 0);
}

TEST(PhotoQuality, CountsWhatIsClippedAndMeasuresLight) {
  ColorImage image(10, 10, Vector3f::Constant(0.5f));
  for (int x = 0; x < 10; ++x) image(x, 0) = Vector3f(1, 0.3f, 0.3f);
  for (int x = 0; x < 5; ++x) image(x, 1).setZero();
  const PhotoQuality quality = photo_quality(image);
  EXPECT_NEAR(quality.burnt, 0.10, 1e-12);
  EXPECT_NEAR(quality.black, 0.05, 1e-12);
  const ColorImage grey(8, 8, Vector3f::Constant(srgb_from_linear(0.25f)));
  const ColorImage darker(8, 8, Vector3f::Constant(srgb_from_linear(0.125f)));
  EXPECT_NEAR(photo_quality(grey).brightness - photo_quality(darker).brightness, 1, 1e-4);
}

TEST(PhotoFlaws, NameWhoDiffersFromTheOthers) {
  std::vector<PhotoQuality> photographs(5, {.blur = 0.3, .brightness = -2});
  photographs[1].blur = 0.55;
  photographs[2].brightness = -3.2;
  photographs[3].burnt = 0.4;
  const std::vector<PhotoFlaws> flaws = photo_flaws(photographs);
  for (size_t i = 0; i < flaws.size(); ++i) {
    EXPECT_EQ(flaws[i].is_blurred, i == 1) << i;
    EXPECT_EQ(flaws[i].is_off_exposure, i == 2) << i;
    EXPECT_EQ(flaws[i].is_burnt, i == 3) << i;
  }
  EXPECT_NEAR(flaws[2].stops, -1.2, 1e-12);
  EXPECT_TRUE(photo_flaws({}).empty());
}

}  // namespace
}  // namespace cgs::photo_quality_test
