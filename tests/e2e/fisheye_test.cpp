// SPDX-License-Identifier: GPL-3.0-or-later
//
// The portal photographed through a fisheye lens, against what a pinhole camera records.
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "samples/capture/render.h"
#include "tests/support/fisheye_portal.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::run_cgs;

constexpr int kDivisor = 3;

class FisheyePortal : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new test::TempDir;
    portal_ = new PortalScene(portal_scene());
    test::write_fisheye_capture(capture(), *portal_, kDivisor);
  }
  static void TearDownTestSuite() {
    delete portal_;
    delete dir_;
  }
  static fs::path capture() { return *dir_ / "capture"; }
  static std::string run(const fs::path& output, const std::string& more) {
    const auto result = run_cgs("run " + capture().string() +
                                " --views view_01,view_02,view_03 --assume-unit m --set steps=0 "
                                "--voxel-size 0.1 -q -o " +
                                output.string() + more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  }

  static void write_larger(const fs::path& folder) {
    fs::create_directories(folder / "images");
    for (const auto& file : fs::directory_iterator(capture() / "images")) {
      const ColorImage image = read_image(file.path());
      ColorImage larger(2 * image.width, 2 * image.height, Eigen::Vector3f::Zero());
      for (int y = 0; y < larger.height; ++y) {
        for (int x = 0; x < larger.width; ++x) larger(x, y) = image(x / 2, y / 2);
      }
      write_png(folder / "images" / file.path().filename(), larger);
    }
    json transforms = json::parse(test::read_bytes(capture() / "transforms.json"));
    for (const char* key : {"w", "h", "fl_x", "fl_y", "cx", "cy"}) {
      transforms[key] = 2 * transforms[key].get<double>();
    }
    test::write_bytes(folder / "transforms.json", transforms.dump());
  }
  static double mean_psnr(const fs::path& output, const fs::path& scene) {
    const auto result = run_cgs("evaluate " + (output / "model").string() + " --scene " +
                                scene.string() + " --json -q");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["mean"]["psnr"];
  }

  static test::TempDir* dir_;
  static PortalScene* portal_;
};
test::TempDir* FisheyePortal::dir_ = nullptr;
PortalScene* FisheyePortal::portal_ = nullptr;

TEST_F(FisheyePortal, ShowsWhatAPinholeCameraRecords) {
  Scene scene = read_scene(capture(), {.downscale = 1});
  load_images(scene, {0});
  const View& view = scene.views[0];
  const CaptureView truth = test::fisheye_views(kDivisor)[0];
  ASSERT_EQ(view.image.width, truth.camera.width);
  EXPECT_GT(view.image.width, 1.3 * 504 / kDivisor);
  const ColorImage expected =
      render_view(*portal_, sky_visibility(*portal_), truth.camera, truth.seed);
  const auto psnr = [&](int shift) {
    double sum = 0;
    int count = 0;
    for (int y = 2; y < expected.height - 2; ++y) {
      for (int x = 2; x < expected.width - 2; ++x) {
        if (!view.valid.empty() && view.valid(x, y) == 0) continue;
        sum += (view.image(x + shift, y) - expected(x, y)).cast<double>().squaredNorm() / 3;
        ++count;
      }
    }
    EXPECT_GT(count, 0.9 * expected.width * expected.height);
    return -10 * std::log10(sum / count);
  };
  // Sampled at other places, so not the same; but nothing else lies as near.
  EXPECT_GT(psnr(0), 24);
  EXPECT_GT(psnr(0), psnr(1) + 4);
  EXPECT_GT(psnr(0), psnr(-1) + 4);
}

TEST_F(FisheyePortal, HasTheDepthOfThePortal) {
  const fs::path out = *dir_ / "out";
  run(out, "");
  const double tolerance = 0.01 * kDivisor;  // the same part of a pixel as 1 % at full size
  for (const double share : test::fisheye_depth_accuracy(out, *portal_, tolerance)) {
    EXPECT_GT(share, 0.8);
  }
  const auto verified = run_cgs("verify " + out.string());
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  // The same photographs at twice their size show the same.
  write_larger(*dir_ / "larger");
  const double given = mean_psnr(out, capture());
  EXPECT_GT(given, 15);
  EXPECT_NEAR(mean_psnr(out, *dir_ / "larger"), given, 0.5);
}

// Cameras half a degree off are moved back as those of other lenses are.
TEST_F(FisheyePortal, HasItsCamerasRefined) {
  const fs::path file = capture() / "transforms.json";
  const std::string given = test::read_bytes(file);
  json transforms = json::parse(given);
  for (size_t i = 0; i < 3; ++i) {
    json& rows = transforms["frames"][i]["transform_matrix"];
    const Eigen::AngleAxisd turn(0.5 * M_PI / 180,
                                 Eigen::Vector3d(1, double(i) - 1, 0.5).normalized());
    for (size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d turned = turn * Eigen::Vector3d(rows[0][c], rows[1][c], rows[2][c]);
      for (size_t r = 0; r < 3; ++r) rows[r][c] = turned[static_cast<Eigen::Index>(r)];
    }
  }
  const fs::path out = *dir_ / "refined";
  test::write_bytes(file, transforms.dump());
  run(out, " --refine-poses");
  test::write_bytes(file, given);
  const json refined = json::parse(test::read_bytes(out / "run.json"))["refined_poses"];
  EXPECT_EQ(refined["refined"], true) << refined;
  EXPECT_LT(refined["error_after"], 0.5) << refined;
  EXPECT_GT(refined["error_before"], 2 * refined["error_after"].get<double>()) << refined;
}

}  // namespace
}  // namespace cgs
