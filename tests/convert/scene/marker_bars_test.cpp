// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/marker_bars.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/scene/known_distances.h"
#include "io/images/png.h"
#include "libcgs/core/error.h"
#include "tests/support/marker_photo.h"
#include "tests/support/temp_dir.h"

namespace cgs::marker_bars_test {
namespace {

using test::PrintedMarker;

constexpr double kUnit = 4;       // world units per internal unit
constexpr double kMetres = 0.25;  // per world unit: an internal unit is a metre
constexpr const char* kSize = "30cm";

/// Photographs of markers of 30 cm, some 1.2 m away, worked on at half their size.
class MarkerBars : public testing::Test {
 protected:
  void photograph(const std::vector<PrintedMarker>& markers, int photographs = 3) {
    scene_ = Scene();
    scene_.frame.scale = kUnit;
    for (int i = 0; i < photographs; ++i) {
      View view;
      view.name = "photo" + std::to_string(i);
      view.image_path = dir_ / (view.name + ".png");
      Camera camera = {480, 360, 450, 450, 240, 180, Eigen::Isometry3d::Identity()};
      camera.world_from_cam = Eigen::Translation3d(0.2 * i - 0.2, 0.05 * i, 0) *
                              Eigen::AngleAxisd(0.15 * (1 - i), Eigen::Vector3d::UnitY());
      write_png(view.image_path, test::photograph_of(markers, camera));
      view.camera = resized(camera, 240, 180);
      scene_.views.push_back(view);
      scene_.input.push_back(i);
    }
  }
  static PrintedMarker marker_at(const Eigen::Vector3d& place, int number) {
    PrintedMarker out;
    out.number = number;
    out.side = 0.3;
    out.world_from_paper =
        Eigen::Translation3d(place) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY());
    return out;
  }
  std::string refusal(const std::string& size = kSize) {
    try {
      marker_bars(scene_, size);
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "";
  }
  test::TempDir dir_;
  Scene scene_;
};

TEST_F(MarkerBars, MeasureTheSideWithinItsSigma) {
  photograph({marker_at({-0.2, 0, 1.2}, 1), marker_at({0.22, 0.05, 1.3}, 2)});
  const std::vector<MarkerBar> bars = marker_bars(scene_, "30cm+-1mm");
  ASSERT_EQ(bars.size(), 2u);
  for (const MarkerBar& marker : bars) {
    EXPECT_EQ(marker.photographs, 3);
    EXPECT_EQ(marker.bar.known, 0.3);
    EXPECT_NEAR(marker.bar.known_sigma, 0.001, 1e-12);
    EXPECT_NEAR(marker.bar.measured, 0.3 * kUnit, 3 * marker.bar.measured_sigma) << marker.name;
    EXPECT_NEAR(marker.bar.measured, 0.3 * kUnit, 0.004 * 0.3 * kUnit) << marker.name;
    EXPECT_LT(marker.bar.measured_sigma, 0.005 * 0.3 * kUnit);
    EXPECT_GT(marker.bar.measured_sigma, 1e-4 * 0.3 * kUnit);
  }
  Model model;
  model.scene = scene_;
  const auto scale = scale_by({}, bars, model);
  ASSERT_TRUE(scale);
  EXPECT_NEAR(model.scene.frame.metres_per_unit, kMetres, 0.003 * kMetres);
  EXPECT_EQ(model.scene.frame.scale_source, ScaleSource::KnownDistance);
  EXPECT_EQ(scale->distances[0].name, "side of marker AprilTag 36h11 1, 3 photographs");
}

// One size is stated for all of them.
TEST_F(MarkerBars, ManyDoNotTellTheStatedSizeBetter) {
  photograph({marker_at({-0.35, -0.2, 1.5}, 1),
              marker_at({0.35, -0.2, 1.5}, 2),
              marker_at({-0.35, 0.2, 1.5}, 3),
              marker_at({0.35, 0.2, 1.5}, 4)});
  const std::vector<MarkerBar> bars = marker_bars(scene_, "30cm+-6mm");
  ASSERT_EQ(bars.size(), 4u);
  Model model;
  model.scene = scene_;
  const auto scale = scale_by({}, bars, model);
  ASSERT_TRUE(scale);
  const double relative = model.scene.frame.metres_sigma / model.scene.frame.metres_per_unit;
  EXPECT_GT(relative, 0.02);
  EXPECT_LT(relative, 0.023);
  EXPECT_EQ(scale->distances.size(), 4u);
  EXPECT_LT(scale->distances[0].sigma, 0.002) << "of this side alone";
}

TEST_F(MarkerBars, RefusesWhereNoTwoPhotographsShowASquare) {
  photograph({marker_at({-0.2, 0, 1.2}, 1)}, 1);
  EXPECT_NE(refusal().find("found: AprilTag 36h11 1 in 1 photograph;"), std::string::npos)
      << refusal();
  photograph({});
  EXPECT_NE(refusal().find("found: none;"), std::string::npos) << refusal();
  PrintedMarker stretched = marker_at({0, 0, 1.2}, 1);
  stretched.stretch = 1.3;
  photograph({stretched});
  EXPECT_NE(refusal().find("in 3 photographs"), std::string::npos) << refusal();
  EXPECT_NE(refusal("big").find("big"), std::string::npos);
}

// Cameras that are 2 pixels wrong must show in the sigma.
TEST_F(MarkerBars, SigmaCoversCamerasThatAreNotQuiteRight) {
  photograph({marker_at({-0.2, 0, 1.2}, 1)});
  const double sigma = marker_bars(scene_, kSize).at(0).bar.measured_sigma;
  scene_.views[1].camera.world_from_cam.rotate(
      Eigen::AngleAxisd(2.0 / 450, Eigen::Vector3d(1, 1, 0).normalized()));
  const ScaleBar bar = marker_bars(scene_, kSize).at(0).bar;
  EXPECT_GT(bar.measured_sigma, 3 * sigma);
  EXPECT_NEAR(bar.measured, 0.3 * kUnit, 3 * bar.measured_sigma);
}

// The same number, stuck to another place between two photographs.
TEST_F(MarkerBars, DoesNotBelieveAMarkerThatMoved) {
  photograph({marker_at({-0.2, 0, 1.2}, 1)});
  Camera second = resized(scene_.views[1].camera, 480, 360);
  write_png(scene_.views[1].image_path,
            test::photograph_of({marker_at({0.1, 0.1, 1.2}, 1)}, second));
  EXPECT_NE(refusal().find("no square marker"), std::string::npos) << refusal();
}

}  // namespace
}  // namespace cgs::marker_bars_test
