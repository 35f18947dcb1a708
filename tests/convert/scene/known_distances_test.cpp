// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/known_distances.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/scenes/fisheye_map.h"
#include "libcgs/core/error.h"
#include "tests/support/exif_segment.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::known_distances_test {
namespace {

using test::message_of;

constexpr int kFileWidth = 240;
constexpr int kFileHeight = 160;
constexpr int kDownscale = 4;
constexpr double kDepth = 0.5;    // internal, of a wall across the view
constexpr double kUnit = 8;       // world units per internal unit
constexpr double kSigma = 0.002;  // of the depth, internal

/// Two photographs of a wall, worked on at a quarter of their size, and one held out.
class KnownDistances : public testing::Test {
 protected:
  void SetUp() override {
    model_.scene.frame.scale = kUnit;
    for (const char* name : {"left", "middle", "right"}) {
      View view;
      view.name = name;
      view.image_path = dir_ / (view.name + ".png");
      test::write_bytes(view.image_path, test::rgb_png(kFileWidth, kFileHeight, 1));
      view.camera = {kFileWidth / kDownscale, kFileHeight / kDownscale, 50, 52, 31, 19, {}};
      view.camera.world_from_cam = Eigen::Isometry3d::Identity();
      view.camera.world_from_cam.translation().x() = 0.1 * double(model_.scene.views.size());
      model_.scene.views.push_back(view);
    }
    model_.scene.input = {0, 2};
    model_.scene.held_out = {1};
    for (int k = 0; k < 2; ++k) model_.priors.push_back(wall());
  }

  static ViewPriors wall() {
    const int width = kFileWidth / kDownscale;
    const int height = kFileHeight / kDownscale;
    ViewPriors priors;
    priors.depth = DepthMap(width, height, float(kDepth));
    priors.sigma = DepthMap(width, height, float(kSigma));
    priors.origin = Raster<DepthOrigin>(width, height, DepthOrigin::Measured);
    return priors;
  }

  DistanceScale scale(const std::vector<DistanceWords>& words) {
    return scale_by(known_distances(words, model_.scene), {}, model_).value();
  }

  /// Pixel of the file that sees a point of the wall, as users type it.
  std::string pixel_of(int index, double x, double y) const {
    const View& view = model_.scene.views[size_t(index)];
    const Eigen::Vector3d p = view.camera.cam_from_world() * Eigen::Vector3d(x, y, kDepth);
    const double a = p.x() / p.z();
    const double b = p.y() / p.z();
    const auto [k1, k2, p1, p2, k3] = view.distortion;  // Brown-Conrady, written out
    const double r2 = a * a + b * b;
    const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double u = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a);
    const double v = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b;
    const Camera& camera = view.camera;
    return view.name + ":" + std::to_string((camera.fx * u + camera.cx) * kDownscale - 0.5) + "," +
           std::to_string((camera.fy * v + camera.cy) * kDownscale - 0.5);
  }

  test::TempDir dir_;
  Model model_;
};

TEST_F(KnownDistances, GiveTheLengthOfAUnit) {
  // 0.2 internal units = 1.6 world units = 4 m.
  const auto report = scale({{pixel_of(0, -0.1, 0), pixel_of(0, 0.1, 0), "400cm"}});
  EXPECT_NEAR(model_.scene.frame.metres_per_unit, 2.5, 1e-5);
  EXPECT_EQ(model_.scene.frame.scale_source, ScaleSource::KnownDistance);
  EXPECT_NEAR(report.distances[0].measured, 4, 1e-9);
  EXPECT_TRUE(report.warnings.empty());
}

TEST_F(KnownDistances, MayEndInTwoPhotographsAndBeTakenThroughALens) {
  for (View& view : model_.scene.views) view.distortion = {-0.12, 0.03, 0.002, -0.001, 0.01};
  scale({{pixel_of(0, -0.1, 0.05), pixel_of(2, 0.15, -0.05), "2m"}});
  EXPECT_NEAR(model_.scene.frame.metres_per_unit, 2 / (kUnit * std::hypot(0.25, 0.1)), 1e-5);
}

TEST_F(KnownDistances, MayBePickedThroughAFisheye) {
  // The picture worked on is a quarter of what the lens makes of 240 x 160 pixels.
  const Fisheye lens{
      {.width = kFileWidth, .height = kFileHeight, .fx = 130, .fy = 130, .cx = 122, .cy = 77},
      {0.03, -0.01, 0.002, 0},
      {},
      0};
  const auto pick = [&](double x, double y) {  // the model, written out
    const double angle = std::atan2(std::hypot(x, y), kDepth);
    const double s = angle * angle;
    const double bent = angle * (1 + s * (0.03 + s * (-0.01 + s * 0.002))) / std::hypot(x, y);
    return "left:" + std::to_string(130 * bent * x + 122 - 0.5) + "," +
           std::to_string(130 * bent * y + 77 - 0.5);
  };
  for (const int larger : {1, 2}) {  // than the photographs that the model was made of
    Fisheye recorded = lens;
    recorded.photograph = resized(lens.photograph, kFileWidth / larger, kFileHeight / larger);
    const Camera picture = FisheyeMap(recorded).picture();
    const int width = picture.width * larger / kDownscale;
    const int height = picture.height * larger / kDownscale;
    for (View& view : model_.scene.views) {
      view.fisheye = recorded;
      const Eigen::Isometry3d pose = view.camera.world_from_cam;
      view.camera = resized(picture, width, height);
      view.camera.world_from_cam = pose;
    }
    for (ViewPriors& priors : model_.priors) {
      priors.depth = DepthMap(width, height, float(kDepth));
      priors.sigma = DepthMap(width, height, float(kSigma));
      priors.origin = Raster<DepthOrigin>(width, height, DepthOrigin::Measured);
    }
    model_.scene.frame.metres_per_unit = 0;
    scale({{pick(-0.35, 0.05), pick(0.3, -0.1), "2m"}});
    EXPECT_NEAR(model_.scene.frame.metres_per_unit, 2 / (kUnit * std::hypot(0.65, 0.15)), 1e-5);
  }
}

TEST_F(KnownDistances, ArePickedAsViewersTurnThePicture) {
  // Cameras that came with the photographs are for the pixels as stored; the tag says upside down.
  std::string jpeg = test::jpeg(kFileWidth, kFileHeight);
  jpeg.insert(2, test::orientation_segment(3));
  model_.scene.views[0].image_path = dir_ / "left.jpg";
  test::write_bytes(dir_ / "left.jpg", jpeg);
  const auto turned_pick = [&](double x, double y) {
    const KnownDistance::Pick pick =
        known_distances({{pixel_of(2, x, y), pixel_of(2, x, y), "1m"}}, model_.scene)[0].a;
    // The same point is seen 0.2 / 0.5 * 50 pixels further right, four of the file each.
    return "left:" + std::to_string(kFileWidth - 1 - (pick.x + 80)) + "," +
           std::to_string(kFileHeight - 1 - pick.y);
  };
  scale({{turned_pick(-0.1, 0.02), turned_pick(0.05, 0.02), "3m"}});
  EXPECT_NEAR(model_.scene.frame.metres_per_unit, 3 / (kUnit * 0.15), 1e-4);
  EXPECT_NEAR(known_distances({{turned_pick(-0.1, 0.02), "right:1,1", "3m"}}, model_.scene)[0].a.y,
              (52 * 0.02 / kDepth + 19) * kDownscale - 0.5,
              1e-3);
}

TEST_F(KnownDistances, SigmaIsThatOfDepthAndPixel) {
  const std::vector<DistanceWords> words = {{pixel_of(0, -0.1, 0), pixel_of(0, 0.1, 0), "4m+-1cm"}};
  scale(words);
  // Along x, a change of depth moves the ends by x / z; half a pixel is z / 2f. Twice each.
  const double by_depth = kSigma * 0.1 / kDepth;
  const double slope = 0.1 / kDepth;
  const double by_pixel = 0.5 * kDepth / std::sqrt(50. * 52) / std::sqrt(1 + slope * slope);
  const double length = std::sqrt(2.0) * std::hypot(by_depth, by_pixel) / 0.2;
  EXPECT_NEAR(model_.scene.frame.metres_sigma / model_.scene.frame.metres_per_unit,
              std::hypot(length, 0.01 / 4),
              1e-5);
}

TEST_F(KnownDistances, NameTheOneOfThreeThatIsWrong) {
  const auto report = scale({{pixel_of(0, -0.1, 0), pixel_of(0, 0.1, 0), "4m"},
                             {pixel_of(0, -0.1, 0.1), pixel_of(0, 0.1, 0.1), "4m"},
                             {pixel_of(2, 0.1, -0.1), pixel_of(2, 0.3, -0.1), "6m"}});
  EXPECT_NEAR(model_.scene.frame.metres_per_unit, 2.5, 1e-5);
  EXPECT_FALSE(report.distances[2].is_used);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("6m"), std::string::npos);
}

TEST_F(KnownDistances, WarnOfAScaleThatTheSceneContradicts) {
  model_.scene.frame.metres_per_unit = 1;
  model_.scene.frame.scale_source = ScaleSource::CameraPoses;
  const DistanceWords right = {pixel_of(0, 0, 0), pixel_of(0, 0.1, 0), "80cm"};
  EXPECT_EQ(scale({right}).warnings.size(), 0u);
  const DistanceWords wrong = {pixel_of(0, 0, 0), pixel_of(0, 0.1, 0), "1.6m"};
  const auto report = scale({wrong});
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("the known distances that it is 2 m"), std::string::npos)
      << report.warnings[0];
}

TEST_F(KnownDistances, WithoutAnyNothingChanges) {
  EXPECT_FALSE(scale_by({}, {}, model_).has_value());
  EXPECT_FALSE(model_.scene.frame.has_metric_scale());
}

TEST_F(KnownDistances, RefusesWhatCannotBeMeasured) {
  const std::string good = pixel_of(0, 0.1, 0);
  const auto refusal = [&](const std::string& a, const std::string& length) {
    return message_of([&] { scale({{a, good, length}}); });
  };
  EXPECT_NE(refusal("left", "1m").find("VIEW:X,Y"), std::string::npos);
  EXPECT_NE(refusal("left:1,2x", "1m").find("VIEW:X,Y"), std::string::npos);
  EXPECT_NE(refusal("left:nan,2", "1m").find("VIEW:X,Y"), std::string::npos);
  EXPECT_NE(refusal("nowhere:1,2", "1m").find("nowhere"), std::string::npos);
  EXPECT_NE(refusal("middle:1,2", "1m").find("held out"), std::string::npos);
  EXPECT_NE(refusal("left:240,2", "1m").find("240 x 160"), std::string::npos);
  EXPECT_NE(refusal("left:1,2", "1").find("unit"), std::string::npos);
  EXPECT_NE(refusal("left:1,2", "1m+-2").find("unit"), std::string::npos);
  EXPECT_NE(refusal("left:1,2", "-1m").find("length"), std::string::npos);
  EXPECT_THROW(check_known_distances({{"nowhere:1,2", good, "1m"}}, model_.scene), InvalidInput);
  EXPECT_THROW(check_known_distances({{"left:1,2", good, "1"}}, model_.scene), InvalidInput);
  EXPECT_NO_THROW(check_known_distances({{"left:240,2", good, "1m"}}, model_.scene));
  EXPECT_NE(refusal(good, "1m").find("one point"), std::string::npos);
  model_.priors[0].origin = Raster<DepthOrigin>(60, 40, DepthOrigin::Completed);
  EXPECT_NE(refusal("left:1,2", "1m").find("no depth was measured at left:1,2"), std::string::npos);
  const auto picks = known_distances({{"left:1,2", good, "1m"}}, model_.scene);
  EXPECT_THROW(check_picks(picks, model_), InvalidInput) << "before the training";
  EXPECT_FALSE(model_.scene.frame.has_metric_scale());
}

}  // namespace
}  // namespace cgs::known_distances_test
