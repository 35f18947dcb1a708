// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/views.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/png.h"
#include "tests/support/temp_dir.h"

namespace cgs::views_test {
namespace {

constexpr int kSide = 40;

// Photographs that differ only where their masks are black, from a model of nothing.
TEST(EvaluateViews, LooksAtNoMaskedPixel) {
  const test::TempDir dir;
  Model model;
  for (const float masked : {0.0f, 1.0f}) {
    ColorImage photograph(kSide, kSide, Eigen::Vector3f::Constant(0.3f));
    ColorImage mask(kSide, kSide, Eigen::Vector3f::Ones());
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        photograph(x, y) += Eigen::Vector3f::Constant(0.01f * float((x * y) % 7));
        if (x >= kSide / 2) continue;
        photograph(x, y) = Eigen::Vector3f(masked, 0, masked);
        mask(x, y) = Eigen::Vector3f::Zero();
      }
    }
    View& view = model.scene.views.emplace_back();
    view.name = masked > 0 ? "magenta" : "black";
    view.image_path = dir / (view.name + ".png");
    view.camera = {kSide, kSide, 50, 50, 20, 20, Eigen::Isometry3d::Identity()};
    write_png(view.image_path, photograph);
    view.mask_path = dir / (view.name + ".mask.png");
    write_png(view.mask_path, mask);
  }
  const auto rows = evaluate_views(model, {0, 1}, {})["views"];
  ASSERT_TRUE(rows[0]["ssim"].is_number());
  EXPECT_EQ(rows[0]["ssim"], rows[1]["ssim"]);
  EXPECT_EQ(rows[0]["psnr"], rows[1]["psnr"]);
  EXPECT_TRUE(rows[0]["ms_ssim"].is_null()) << "half of it would count as equal";

  Model without = model;
  without.scene.views[1].image_path.clear();
  EXPECT_EQ(evaluate_views(without, {0, 1}, {})["views"].size(), 1u);
  EXPECT_EQ(without.scene.warnings.back(), "view magenta has no photograph and is not evaluated");

  write_png(model.scene.views[0].mask_path, ColorImage(kSide, kSide, Eigen::Vector3f::Zero()));
  const auto masked = evaluate_views(model, {0, 1}, {});
  EXPECT_TRUE(masked["views"][0]["hole_fraction"].is_null()) << "nothing may be looked at";
  EXPECT_EQ(masked["mean"]["hole_fraction"], masked["views"][1]["hole_fraction"]);
}

}  // namespace
}  // namespace cgs::views_test
