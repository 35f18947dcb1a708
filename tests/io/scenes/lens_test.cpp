// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/lens.h"

#include <array>
#include <set>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::lens_test {
namespace {

constexpr std::array<double, 5> kBarrel = {-0.12, 0.02, 0.001, -0.002, 0};

// A photograph of 160 x 120 pixels whose picture is worked on at half the size.
class Lens : public ::testing::Test {
 protected:
  Lens() {
    test::write_bytes(dir_ / "a.png", test::rgb_png(160, 120));
    view_.image_path = dir_ / "a.png";
    view_.camera = {.width = 80, .height = 60, .fx = 70, .fy = 71, .cx = 41.5, .cy = 29};
  }

  test::TempDir dir_;
  View view_;
};

// OpenCV counts pixel centres from 0.
Eigen::Vector2d by_opencv(const Eigen::Vector2d& in_picture, const Camera& c) {
  const std::vector<cv::Point3d> rays = {
      {(in_picture.x() - c.cx) / c.fx, (in_picture.y() - c.cy) / c.fy, 1}};
  std::vector<cv::Point2d> out;
  cv::projectPoints(rays,
                    cv::Vec3d(),
                    cv::Vec3d(),
                    cv::Matx33d(c.fx, 0, c.cx - 0.5, 0, c.fy, c.cy - 0.5, 0, 0, 1),
                    cv::Mat(std::vector<double>(kBarrel.begin(), kBarrel.end())),
                    out);
  return {out[0].x + 0.5, out[0].y + 0.5};
}

TEST_F(Lens, CameraOfThePictureHasTheSizeOfThePhotograph) {
  const Camera camera = picture_camera(view_);
  EXPECT_EQ(camera.width, 160);
  EXPECT_EQ(camera.height, 120);
  EXPECT_DOUBLE_EQ(camera.fx, 140);
  EXPECT_DOUBLE_EQ(camera.cx, 83);
}

TEST_F(Lens, PutsPointsWhereOpenCvDoesAndFindsThemAgain) {
  view_.distortion = kBarrel;
  EXPECT_TRUE(has_lens_distortion(view_));
  const Camera camera = picture_camera(view_);
  const LensMap map(view_, camera);
  for (double x = 5; x < 160; x += 31) {
    for (double y = 4; y < 120; y += 29) {
      const auto there = map.in_photograph({x, y});
      ASSERT_TRUE(there.has_value());
      EXPECT_LT((*there - by_opencv({x, y}, camera)).norm(), 1e-9) << x << ' ' << y;
      const auto back = map(*there);
      ASSERT_TRUE(back.has_value());
      EXPECT_LT((back->at - Eigen::Vector2d(x, y)).norm(), 1e-3) << x << ' ' << y;
    }
  }
}

TEST_F(Lens, PointsBeyondTheFoldHaveNoPlace) {
  view_.distortion = {-1.5, 0, 0, 0, 0};  // r - 1.5 r^3 grows no further than 0.31
  const LensMap map(view_, picture_camera(view_));
  EXPECT_TRUE(map({83, 58}).has_value());
  EXPECT_FALSE(map({1, 1}).has_value());
}

TEST_F(Lens, WithoutDistortionNothingMoves) {
  EXPECT_FALSE(has_lens_distortion(view_));
  const LensMap map(view_, picture_camera(view_));
  EXPECT_EQ(map.in_photograph({12.5, 100.25}), Eigen::Vector2d(12.5, 100.25));
}

TEST_F(Lens, OfAFisheyeIsThatOfTheLensAtTheSizeOfThePhotograph) {
  view_.fisheye = Fisheye{view_.camera, {-0.03, 0.012, -0.006, 0.001}, {}, 0};
  EXPECT_TRUE(has_lens_distortion(view_));
  const Camera camera = picture_camera(view_);
  const FisheyeMap twice = FisheyeMap(*view_.fisheye).resized(160, 120);
  EXPECT_EQ(camera.width, twice.picture().width);
  const LensMap map(view_, camera);
  const auto there = map.in_photograph({40, 30});
  ASSERT_TRUE(there.has_value());
  EXPECT_EQ(*there, twice.in_photograph({40, 30}));
}

TEST_F(Lens, EveryNumberOfItTells) {
  std::set<std::vector<double>> seen = {lens_numbers(view_)};
  for (double& k : view_.distortion) {
    k = 0.01;
    EXPECT_TRUE(seen.insert(lens_numbers(view_)).second);
  }
  view_.fisheye = Fisheye{view_.camera, {}, {}, 0};
  EXPECT_TRUE(seen.insert(lens_numbers(view_)).second);
  Fisheye& f = *view_.fisheye;
  Camera& c = f.photograph;
  for (double* value : {&c.fx,
                        &c.fy,
                        &c.cx,
                        &c.cy,
                        &f.k[0],
                        &f.k[1],
                        &f.k[2],
                        &f.k[3],
                        &f.p[0],
                        &f.p[1],
                        &f.radius}) {
    *value += 0.5;
    EXPECT_TRUE(seen.insert(lens_numbers(view_)).second);
  }
  for (int* value : {&c.width, &c.height}) {
    ++*value;
    EXPECT_TRUE(seen.insert(lens_numbers(view_)).second);
  }
}

}  // namespace
}  // namespace cgs::lens_test
