// SPDX-License-Identifier: GPL-3.0-or-later
// The portal as three old prints show it, against the portal as three good photographs do.
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/image.h"
#include "io/images/png.h"
#include "libcgs/core/photo_response.h"
#include "tests/support/colored_wall.h"
#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"
#include "tests/support/temp_dir.h"

namespace cgs::old_photographs_test {
namespace {

using Eigen::Vector3f;
using nlohmann::ordered_json;
using test::run_cgs;

const std::filesystem::path kClean = test::portal_capture(3);

void scratch(ColorImage& image, double from, double to, const Vector3f& color) {
  for (int y = 0; y < image.height; ++y) {
    const double x = image.width * (from + (to - from) * y / image.height);
    image(static_cast<int>(x), y) = color;
  }
}

void frame(ColorImage& image, int width, const Vector3f& tone) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const bool is_inside =
          x >= width && y >= width && x < image.width - width && y < image.height - width;
      if (!is_inside) image(x, y) = tone;
    }
  }
}

template <typename Change>
void change(const std::filesystem::path& capture, int view, const Change& by) {
  const auto file = capture / ("images/view_0" + std::to_string(view) + ".png");
  ColorImage image = read_image(file, nullptr, {});
  by(image);
  write_png(file, image);
}

// All at once: gains, gammas, the light falling off, one in grey, scratches.
void age(const std::filesystem::path& capture) {
  change(capture, 1, [](ColorImage& image) {
    test::print(image, {0.8, 0.75, 0.7}, 0.8, 0.3);
    scratch(image, 0.2, 0.5, Vector3f::Constant(0.95f));
  });
  change(capture, 2, [](ColorImage& image) {
    test::print(image, {1, 1, 1}, 1, 0.3);
    scratch(image, 0.7, 0.6, Vector3f::Constant(0.05f));
  });
  change(capture, 3, [](ColorImage& image) {
    image = in_grey(image);
    test::print(image, {1.1, 1.1, 1.1}, 1.25, 0.3);
    scratch(image, 0.4, 0.9, Vector3f::Constant(0.95f));
  });
}

// Of the views held out, which are as good as ever, matched in exposure alone.
double held_out_psnr(const std::filesystem::path& capture,
                     const std::filesystem::path& model,
                     const std::string& options) {
  const auto trained =
      run_cgs("train " + capture.string() + " --views view_01,view_02,view_03 --preset draft -q " +
              options + " -o " + model.string());
  EXPECT_EQ(trained.exit_code, 0) << trained.err;
  const auto evaluation = run_cgs("evaluate " + model.string() + " -q --json");
  EXPECT_EQ(evaluation.exit_code, 0) << evaluation.err;
  return ordered_json::parse(evaluation.out)["mean"]["psnr_seen"].get<double>();
}

ordered_json training_of(const std::filesystem::path& model) {
  return ordered_json::parse(test::read_bytes(model / "training.json"));
}

// Borders of paper, which hide some of what clean ones show.
void mount(const std::filesystem::path& capture) {
  change(capture, 1, [](ColorImage& image) { frame(image, 7, {0.93f, 0.92f, 0.88f}); });
  change(capture, 3, [](ColorImage& image) { frame(image, 7, Vector3f::Constant(0.02f)); });
}

TEST(OldPhotographs, ComeNearWhatCleanOnesGive) {
  const test::TempDir dir;
  std::filesystem::copy(kClean, dir / "old", std::filesystem::copy_options::recursive);
  age(dir / "old");
  const double clean = held_out_psnr(kClean, dir / "clean", "");
  const double unaided = held_out_psnr(dir / "old", dir / "unaided", "");
  const double aided = held_out_psnr(dir / "old", dir / "aided", "--old-photographs");
  std::printf("clean %.2f dB; aged %.2f, with --old-photographs %.2f\n", clean, unaided, aided);
  EXPECT_GT(aided, clean - 0.5);
  // One of them is grey, so that responses are fitted unasked.
  EXPECT_GT(unaided, clean - 0.5);

  const ordered_json training = training_of(dir / "aided");
  EXPECT_EQ(training["responses"]["reference"], "view_02");
  const ordered_json& views = training["responses"]["views"];
  EXPECT_NEAR(views[0]["gamma"].get<double>(), 1 / 0.8, 0.1);
  EXPECT_NEAR(views[2]["gamma"].get<double>(), 1 / 1.25, 0.1);
  EXPECT_TRUE(views[2]["grey"].get<bool>());
  for (const auto& view : views) EXPECT_GT(view["mended"].get<double>(), 0.002);
  EXPECT_GT(training["grey"]["views"][0]["share_without_color"].get<double>(), 0);
  EXPECT_LT(training["grey"]["views"][0]["share_without_color"].get<double>(), 0.6);
}

TEST(OldPhotographs, AreLookedAtWithinTheirBorders) {
  const test::TempDir dir;
  std::filesystem::copy(kClean, dir / "old", std::filesystem::copy_options::recursive);
  age(dir / "old");
  mount(dir / "old");
  const double unaided = held_out_psnr(dir / "old", dir / "unaided", "");
  const double aided = held_out_psnr(dir / "old", dir / "aided", "--old-photographs");
  std::printf("in borders %.2f dB, with --old-photographs %.2f\n", unaided, aided);
  EXPECT_GT(aided, unaided + 3);
}

TEST(OldPhotographs, AreNotMadeOfCleanOnes) {
  const test::TempDir dir;
  const double clean = held_out_psnr(kClean, dir / "clean", "");
  const double asked = held_out_psnr(kClean, dir / "asked", "--old-photographs");
  EXPECT_NEAR(asked, clean, 0.1);
  const ordered_json training = training_of(dir / "asked");
  for (const auto& term : training["responses"]["terms"]) {
    EXPECT_FALSE(term["used"].get<bool>()) << term;
  }
  EXPECT_FALSE(training.contains("grey"));
  EXPECT_FALSE(training_of(dir / "clean").contains("responses"));
}

// Without being asked for, since nothing else can be meant.
TEST(OldPhotographs, LoseNothingToAGreyOneAmongOthers) {
  const test::TempDir dir;
  std::filesystem::copy(kClean, dir / "grey", std::filesystem::copy_options::recursive);
  change(dir / "grey", 3, [](ColorImage& image) { image = in_grey(image); });
  const double clean = held_out_psnr(kClean, dir / "clean", "");
  EXPECT_GT(held_out_psnr(dir / "grey", dir / "model", ""), clean - 0.3);
  const ordered_json training = training_of(dir / "model");
  EXPECT_EQ(training["grey"]["views"][0]["view"], "view_03");
  const std::string cameras = test::read_bytes(dir / "model/cameras.json");
  EXPECT_NE(cameras.find("\"grey\": true"), std::string::npos) << cameras.substr(0, 2000);
}

TEST(OldPhotographs, GiveTheSameBytesForAnyNumberOfThreads) {
  const test::TempDir dir;
  std::filesystem::copy(
      test::portal_capture(6), dir / "old", std::filesystem::copy_options::recursive);
  age(dir / "old");
  for (const std::string threads : {"1", "3"}) {
    const auto trained = run_cgs("train " + (dir / "old").string() +
                                 " --views view_01,view_02,view_03 --set steps=6 -q "
                                 "--old-photographs --threads " +
                                 threads + " -o " + (dir / threads).string());
    ASSERT_EQ(trained.exit_code, 0) << trained.err;
  }
  for (const char* file : {"gaussians.ply", "cameras.json"}) {
    EXPECT_TRUE(test::read_bytes(dir / "1" / file) == test::read_bytes(dir / "3" / file)) << file;
  }
}

TEST(OldPhotographs, WithCamerasHaveTheirLenses) {
  const test::TempDir dir;
  const auto refused =
      run_cgs("train " + kClean.string() + " --lenses each -q -o " + (dir / "model").string());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("--lenses each is for photographs without cameras"), std::string::npos)
      << refused.err;
}

}  // namespace
}  // namespace cgs::old_photographs_test
