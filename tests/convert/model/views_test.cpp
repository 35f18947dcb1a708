// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/views.h"

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/exr.h"
#include "io/images/image.h"
#include "io/images/png.h"
#include "tests/support/exr_channel.h"
#include "tests/support/splat_shapes.h"
#include "tests/support/temp_dir.h"

namespace cgs::views_test {
namespace {

constexpr int kSide = 40;

nlohmann::ordered_json evaluated(Model& model, const std::vector<int>& views) {
  return evaluation_to_json(evaluate_views(model, views, {}));
}

// A view becomes an input that saw nothing anywhere: then everything is a hole, and known to be.
void say_that_it_saw_nothing(Model& model, int view) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  model.scene.input.push_back(view);
  ViewPriors& priors = model.priors.emplace_back();
  priors.depth = DepthMap(kSide, kSide, kNaN);
  priors.sigma = DepthMap(kSide, kSide, kNaN);
  priors.origin = Raster<DepthOrigin>(kSide, kSide, DepthOrigin::Unknown);
}

// A model of nothing, whose photographs are ramps of different grey.
Model model_of_greys(const test::TempDir& dir, int count) {
  Model model;
  model.scene.folder = dir.path();
  for (int k = 0; k < count; ++k) {
    View& view = model.scene.views.emplace_back();
    view.name = std::to_string(k);
    view.image_path = dir / (view.name + ".png");
    view.camera = {kSide, kSide, 50, 50, 20, 20, Eigen::Isometry3d::Identity()};
    ColorImage ramp(kSide, kSide, Eigen::Vector3f::Zero());
    for (size_t i = 0; i < ramp.data.size(); ++i) {
      ramp.data[i].setConstant(0.2f * float(k + 1) * float(i) / float(ramp.data.size()));
    }
    write_png(view.image_path, ramp);
  }
  return model;
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
  EXPECT_EQ(evaluated(without, {0, 1})["views"].size(), 1u);
  EXPECT_EQ(without.scene.warnings.back(), "view magenta has no photograph and is not evaluated");

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
  const auto all = evaluated(model, {0, 1, 2, 3});
  const std::vector<std::string> roles = {"input", "input", "held out", "not used"};
  for (size_t k = 0; k < roles.size(); ++k) EXPECT_EQ(all["views"][k]["role"], roles[k]);
  EXPECT_NE(all["views"][0]["psnr"], all["views"][2]["psnr"]);
  const auto others = evaluated(model, {2, 3});
  EXPECT_EQ(all["mean"], others["mean"]);
  EXPECT_TRUE(model.scene.warnings.empty()) << model.scene.warnings.front();
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
  const auto report = evaluated(model, {0, 1});
  EXPECT_TRUE(report["mean"]["psnr"].is_number());
  ASSERT_EQ(model.scene.warnings.size(), 1u);
  EXPECT_NE(model.scene.warnings[0].find("only input views"), std::string::npos);
}

// As of splats of other programs: not 100 % holes, but nobody knows.
TEST(EvaluateViews, LeavesHolesOutWhereNothingIsKnownOfThem) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 2);
  const auto report = evaluated(model, {0, 1});
  for (const auto& row : {report["views"][0], report["views"][1], report["mean"]}) {
    EXPECT_TRUE(row["psnr"].is_number());
    for (const char* key : {"hole_fraction", "psnr_seen", "ssim_seen"}) {
      EXPECT_TRUE(row[key].is_null()) << key;
    }
  }
  EXPECT_TRUE(report["views"][0]["role"].is_null());
  ASSERT_EQ(model.scene.warnings.size(), 1u);
  EXPECT_EQ(model.scene.warnings[0], unknown_holes_warning(model));
}

TEST(WriteViews, WritesHolesWhereTheyAreKnownAlone) {
  for (const bool is_known : {true, false}) {
    const test::TempDir dir;
    Model model = model_of_greys(dir, 2);
    if (is_known) say_that_it_saw_nothing(model, 0);
    const auto rows = write_views(model, {0, 1}, dir / "views", {});
    const auto frames = write_path(model, {model.scene.views[0].camera}, dir / "path", {});
    for (const auto& row : {rows[0], rows[1], frames[0]}) {
      EXPECT_EQ(row.holes.has_value(), is_known) << row.name;
    }
    EXPECT_EQ(views_to_json(rows)[1]["hole_fraction"].is_number(), is_known);
    EXPECT_EQ(frames_to_json(frames)[0]["hole_fraction"].is_number(), is_known);
    EXPECT_EQ(rows[1].role, is_known ? "not used" : "");
    EXPECT_EQ(std::filesystem::exists(dir / "views" / "0.hole.png"), is_known);
    EXPECT_EQ(std::filesystem::exists(dir / "path" / "frame_0000.hole.png"), is_known);
    EXPECT_TRUE(std::filesystem::exists(dir / "views" / "0.color.png"));
    EXPECT_TRUE(std::filesystem::exists(dir / "path" / "frame_0000.png"));
  }
}

// A splat per pixel: sky in the upper quarter, a wall below, of which the lower half is estimated.
Model wall_below_sky(const test::TempDir& dir) {
  constexpr float kBackdrop = 20;
  Model model = model_of_greys(dir, 1);
  say_that_it_saw_nothing(model, 0);
  ViewPriors& priors = model.priors[0];
  const Camera& camera = model.scene.views[0].camera;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool is_sky = y < kSide / 4;
      const double z = is_sky ? kBackdrop : 2;
      priors.depth(x, y) = static_cast<float>(z);
      priors.sigma(x, y) = is_sky ? kBackdrop / 2 : 0.002f;
      priors.origin(x, y) = is_sky               ? DepthOrigin::Sky
                            : y >= 5 * kSide / 8 ? DepthOrigin::Estimated
                                                 : DepthOrigin::Measured;
      const Eigen::Vector3d place = camera.unproject(x + 0.5, y + 0.5, z);
      test::add_disc(model.gaussians, place, Eigen::Vector3d::UnitZ(), 0.5 * z / camera.fx);
    }
  }
  return model;
}

TEST(WriteViews, FillsWhatNothingIsDrawnInUnlessPhotographsWereMasked) {
  const test::TempDir dir;
  Model model = model_of_greys(dir, 1);
  say_that_it_saw_nothing(model, 0);
  test::add_sheet(model.gaussians, {-0.4, 0, 2}, {0.4, 0, 0}, {0, 1, 0}, 20);  // the left half
  const auto corner = [&](HoleFill fill) {
    write_views(model, {0}, dir / "views", {}, {fill});
    return read_image(dir / "views/0.color.png")(kSide - 2, 20).maxCoeff();
  };
  EXPECT_EQ(corner(HoleFill::None), 0);
  EXPECT_GT(corner(HoleFill::Around), 0.1f);
  model.scene.views[0].mask_path = dir / "mask.png";
  ColorImage mask(kSide, kSide, Eigen::Vector3f::Ones());
  for (int y = 0; y < kSide; ++y) {
    for (int x = kSide / 2; x < kSide; ++x) mask(x, y).setZero();
  }
  write_png(dir / "mask.png", mask);
  EXPECT_EQ(corner(HoleFill::Around), 0) << "what is cut out is empty";
}

TEST(WriteViews, TellsSkyAndWhatIsEstimatedFromHoles) {
  const test::TempDir dir;
  const Model model = wall_below_sky(dir);
  const auto row = write_views(model, {0}, dir / "views", {})[0];
  constexpr double kSoftRim = 0.05;  // two rows
  ASSERT_TRUE(row.holes.has_value());
  EXPECT_NEAR(row.holes->sky, 0.25, kSoftRim);
  EXPECT_NEAR(row.holes->estimated, 0.375, kSoftRim);
  EXPECT_NEAR(row.holes->hole(), 0, kSoftRim);
  const std::filesystem::path file = dir / "views" / "0.exr";
  const ExrImage image = read_exr(file);
  const auto at = [&](const char* channel, int x, int y) {
    return test::channel(image, channel, file)[static_cast<size_t>(y * kSide + x)];
  };
  EXPECT_EQ(at("holeKind.Y", 20, 4), 6);
  EXPECT_EQ(at("Z", 20, 4), 0) << "the depth of a backdrop is none";
  EXPECT_EQ(at("hole.Y", 20, 4), 0);
  EXPECT_EQ(at("holeKind.Y", 20, 18), 0);
  EXPECT_NEAR(at("Z", 20, 18), 2, 1e-4);
  EXPECT_EQ(at("support.Y", 20, 18), 1);
  EXPECT_EQ(at("holeKind.Y", 20, 33), 5);
  EXPECT_NEAR(at("Z", 20, 33), 2, 1e-4);
  EXPECT_EQ(at("support.Y", 20, 33), 0);
}

}  // namespace
}  // namespace cgs::views_test
