// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scan_border.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace cgs::scan_border_test {
namespace {

using Eigen::Vector3f;

constexpr int kWidth = 200;
constexpr int kHeight = 150;

// Stripes and blobs that touch every side.
ColorImage picture() {
  ColorImage out(kWidth, kHeight, Vector3f::Zero());
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double level = 0.5 + 0.3 * std::sin(0.2 * x) * std::cos(0.17 * y);
      out(x, y) = Vector3f(float(level), float(0.9 * level), float(0.8 * level));
    }
  }
  return out;
}

// With dust: one pixel of four hundred is of another tone.
void add_border(ColorImage& image, const ScanBorder& border, const Vector3f& tone) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const bool is_inside = x >= border.left && x < image.width - border.right &&
                             y >= border.top && y < image.height - border.bottom;
      if (is_inside) continue;
      const float grain = 0.01f * float((7 * x + 13 * y) % 5 - 2);
      image(x, y) =
          (x * 31 + y * 17) % 401 == 0 ? Vector3f::Constant(0.5f) : Vector3f(tone.array() + grain);
    }
  }
}

TEST(ScanBorder, IsFoundOnAllSidesOrSome) {
  for (const Vector3f& tone : {Vector3f(0.95f, 0.93f, 0.85f), Vector3f(0.03f, 0.03f, 0.03f)}) {
    for (const ScanBorder& border :
         {ScanBorder{8, 12, 6, 20}, ScanBorder{0, 0, 9, 9}, ScanBorder{5, 0, 0, 7}}) {
      ColorImage image = picture();
      add_border(image, border, tone);
      EXPECT_EQ(find_scan_border(image), border) << tone.x() << " " << border.left;
    }
  }
}

TEST(ScanBorder, IsNotWhatIsNoFrame) {
  EXPECT_EQ(find_scan_border(picture()), ScanBorder{});
  // A clear sky over roofs, with a straight horizon even: one side alone.
  ColorImage sky = picture();
  add_border(sky, {0, 0, 30, 0}, {0.6f, 0.7f, 0.9f});
  EXPECT_EQ(find_scan_border(sky), ScanBorder{});
  // A thing on white: no straight step.
  const ColorImage thing = picture();
  ColorImage alone(kWidth, kHeight, Vector3f::Constant(0.95f));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (std::hypot(x - 100, y - 75) < 60) alone(x, y) = thing(x, y);
    }
  }
  EXPECT_EQ(find_scan_border(alone), ScanBorder{});
  // A wall that gets lighter, and a picture of one colour.
  ColorImage wall(kWidth, kHeight, Vector3f::Zero());
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) wall(x, y).setConstant(0.2f + 0.003f * float(x));
  }
  EXPECT_EQ(find_scan_border(wall), ScanBorder{});
  EXPECT_EQ(find_scan_border(ColorImage(kWidth, kHeight, Vector3f::Ones())), ScanBorder{});
  // More than a quarter of the picture.
  ColorImage wide = picture();
  add_border(wide, {60, 60, 0, 0}, Vector3f::Ones());
  EXPECT_EQ(find_scan_border(wide), ScanBorder{});
  EXPECT_EQ(find_scan_border(ColorImage(3, 2, Vector3f::Ones())), ScanBorder{});
}

TEST(ScanBorder, IsMaskedWithRoundedCorners) {
  ColorImage image = picture();
  const ScanBorder border{8, 8, 8, 8};
  const Vector3f tone(0.95f, 0.93f, 0.9f);
  add_border(image, border, tone);
  constexpr int kRadius = 12;
  const auto is_rounded_off = [&](int x, int y) {
    const double dx = std::max(0, std::max(8 + kRadius - x, x - (kWidth - 9 - kRadius)));
    const double dy = std::max(0, std::max(8 + kRadius - y, y - (kHeight - 9 - kRadius)));
    return dx > 0 && dy > 0 && std::hypot(dx, dy) > kRadius;
  };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (is_rounded_off(x, y)) image(x, y) = tone;
    }
  }
  MaskMap usable;
  mask_scan_border(image, usable);
  ASSERT_FALSE(usable.empty());
  size_t kept = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool is_paper = x < 8 || y < 8 || x >= kWidth - 8 || y >= kHeight - 8;
      if (is_paper || is_rounded_off(x, y)) {
        EXPECT_EQ(usable(x, y), 0) << x << " " << y;
      }
      kept += usable(x, y);
    }
  }
  EXPECT_GT(double(kept), 0.93 * (kWidth - 20) * (kHeight - 20));
  // What was masked before stays so.
  MaskMap masked(kWidth, kHeight, 0);
  mask_scan_border(image, masked);
  EXPECT_EQ(std::count(masked.data.begin(), masked.data.end(), 1), 0);
  MaskMap whole;
  mask_scan_border(picture(), whole);
  EXPECT_TRUE(whole.empty());
}

}  // namespace
}  // namespace cgs::scan_border_test
