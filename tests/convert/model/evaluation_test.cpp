// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/evaluation.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/model/views.h"
#include "io/images/png.h"
#include "tests/support/grey_model.h"
#include "tests/support/temp_dir.h"

namespace cgs::evaluation_test {
namespace {

constexpr int kSide = test::kGreySide;
using test::model_of_greys;
using test::say_that_it_saw_nothing;

nlohmann::ordered_json evaluated(const Model& model, const std::vector<int>& views) {
  return evaluation_to_json(evaluate_views(model, views, {}));
}

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
  model.scene.views.push_back(model.scene.views[0]);
  say_that_it_saw_nothing(model, 2);
  const auto rows = evaluated(model, {0, 1})["views"];
  ASSERT_TRUE(rows[0]["ssim"].is_number());
  EXPECT_EQ(rows[0]["ssim"], rows[1]["ssim"]);
  EXPECT_EQ(rows[0]["psnr"], rows[1]["psnr"]);
  EXPECT_TRUE(rows[0]["ms_ssim"].is_null()) << "half of it would count as equal";

  Model without = model;
  without.scene.views[1].image_path.clear();
  const Evaluation of_one = evaluate_views(without, {0, 1}, {});
  EXPECT_EQ(of_one.views.size(), 1u);
  ASSERT_FALSE(of_one.warnings.empty());
  EXPECT_EQ(of_one.warnings[0], "view magenta has no photograph and is not evaluated");

  write_png(model.scene.views[0].mask_path, ColorImage(kSide, kSide, Eigen::Vector3f::Zero()));
  const auto masked = evaluated(model, {0, 1});
  EXPECT_TRUE(masked["views"][0]["hole_fraction"].is_null()) << "nothing may be looked at";
  EXPECT_EQ(masked["mean"]["hole_fraction"], masked["views"][1]["hole_fraction"]);
}

TEST(EvaluateViews, KeepsInputsOutOfTheMeanAndSaysWhatAViewIs) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 4);
  say_that_it_saw_nothing(model, 0);
  say_that_it_saw_nothing(model, 1);
  model.scene.held_out = {2};
  const Evaluation found = evaluate_views(model, {0, 1, 2, 3}, {});
  EXPECT_TRUE(found.warnings.empty()) << found.warnings.front();
  const auto all = evaluation_to_json(found);
  const std::vector<std::string> roles = {"input", "input", "held out", "not used"};
  for (size_t k = 0; k < roles.size(); ++k) EXPECT_EQ(all["views"][k]["role"], roles[k]);
  EXPECT_NE(all["views"][0]["psnr"], all["views"][2]["psnr"]);
  const auto others = evaluated(model, {2, 3});
  EXPECT_EQ(all["mean"], others["mean"]);
}

TEST(EvaluateViews, TellsTheMeanThatPapersTellOfLlffScenes) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 10);
  say_that_it_saw_nothing(model, 1);
  const auto eighth = [&](const std::vector<int>& views) {
    return evaluated(model, views)["every_eighth"];
  };
  EXPECT_TRUE(eighth({0, 5, 8}).is_null()) << "no LLFF scene";
  model.scene.kind = SceneKind::Llff;
  const auto report = evaluated(model, {0, 5, 8});
  const auto psnr = [&](size_t k) { return report["views"][k]["psnr"].get<double>(); };
  EXPECT_NEAR(report["every_eighth"]["psnr"].get<double>(), (psnr(0) + psnr(2)) / 2, 1e-9);
  EXPECT_NE(report["every_eighth"]["psnr"], report["mean"]["psnr"]);
  EXPECT_TRUE(eighth({0, 5}).is_null()) << "view 8 is missing";
  say_that_it_saw_nothing(model, 8);
  EXPECT_TRUE(eighth({0, 5, 8}).is_null()) << "view 8 is an input";
}

TEST(EvaluateViews, SaysOnceThatOnlyInputsAreEvaluated) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 3);
  say_that_it_saw_nothing(model, 0);
  say_that_it_saw_nothing(model, 1);
  const Evaluation found = evaluate_views(model, {0, 1}, {});
  EXPECT_TRUE(found.mean.psnr);
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_NE(found.warnings[0].find("only input views"), std::string::npos);
}

// As of splats of other programs: not 100 % holes, but nobody knows.
TEST(EvaluateViews, LeavesHolesOutWhereNothingIsKnownOfThem) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 2);
  const Evaluation found = evaluate_views(model, {0, 1}, {});
  const auto report = evaluation_to_json(found);
  for (const auto& row : {report["views"][0], report["views"][1], report["mean"]}) {
    EXPECT_TRUE(row["psnr"].is_number());
    for (const char* key : {"hole_fraction", "psnr_seen", "ssim_seen"}) {
      EXPECT_TRUE(row[key].is_null()) << key;
    }
  }
  EXPECT_TRUE(report["views"][0]["role"].is_null());
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_EQ(found.warnings[0], unknown_holes_warning(model));
}

}  // namespace
}  // namespace cgs::evaluation_test
