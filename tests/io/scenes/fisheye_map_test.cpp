// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/fisheye_map.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "io/scenes/resample.h"
#include "tests/support/scene_files.h"

namespace cgs::fisheye_map_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// 112 x 84 degrees, 138 across the corners.
Fisheye lens() {
  return {{.width = 400, .height = 300, .fx = 205, .fy = 203, .cx = 203.3, .cy = 147.6},
          {-0.03, 0.012, -0.006, 0.001},
          {},
          0};
}

// OpenCV counts pixel centres from 0.
cv::Matx33d intrinsics(const Camera& c) {
  return {c.fx, 0, c.cx - 0.5, 0, c.fy, c.cy - 0.5, 0, 0, 1};
}

Eigen::Vector2d projected_by_opencv(const Fisheye& fisheye, const Eigen::Vector3d& ray) {
  std::vector<cv::Point2d> out;
  cv::fisheye::projectPoints(std::vector<cv::Point3d>{{ray.x(), ray.y(), ray.z()}},
                             out,
                             cv::Vec3d(),
                             cv::Vec3d(),
                             intrinsics(fisheye.photograph),
                             cv::Vec4d(fisheye.k.data()));
  return {out[0].x + 0.5, out[0].y + 0.5};
}

TEST(FisheyeMap, PutsRaysWhereOpenCvDoes) {
  const Fisheye fisheye = lens();
  const FisheyeMap map(fisheye);
  const Camera& picture = map.picture();
  for (double x = 0.5; x < picture.width; x += 29) {
    for (double y = 0.5; y < picture.height; y += 23) {
      const Eigen::Vector2d expected = projected_by_opencv(fisheye, picture.ray_in_cam(x, y));
      EXPECT_LT((map.in_photograph({x, y}) - expected).norm(), 1e-9) << x << ' ' << y;
    }
  }
}

TEST(FisheyeMap, UndoesTheLensToTheLastCorner) {
  Fisheye fisheye = lens();
  fisheye.p = {0.002, -0.003};
  const FisheyeMap map(fisheye);
  for (double u = 0; u <= 400; u += 20) {
    for (double v = 0; v <= 300; v += 20) {
      const auto found = map.in_picture({u, v});
      ASSERT_TRUE(found) << u << ' ' << v;
      EXPECT_LT((map.in_photograph(found->at) - Eigen::Vector2d(u, v)).norm(), 1e-7);
    }
  }
}

// The angle that a pixel of the photograph covers, by differences along and across the radius. That
// of a pixel of the picture, across, is 1 / f times the cosine of the angle off the axis.
TEST(FisheyeMap, KnowsTheAngleUnderAPixelOfThePhotograph) {
  Fisheye fisheye = lens();
  fisheye.photograph.fy = fisheye.photograph.fx;
  for (const double k1 : {-0.03, 0.9}) {  // the second covers more across the radius
    fisheye.k[0] = k1;
    const FisheyeMap map(fisheye);
    const auto ray = [&](const Eigen::Vector2d& at) {
      const Eigen::Vector2d in_picture = map.in_picture(at).value().at;
      return map.picture().ray_in_cam(in_picture.x(), in_picture.y());
    };
    for (double u = 5; u <= 400; u += 30) {
      for (double v = 5; v <= 300; v += 30) {
        const Eigen::Vector2d at(u, v);
        const Eigen::Vector2d out = (at - Eigen::Vector2d(203.3, 147.6)).normalized();
        const Eigen::Vector3d here = ray(at).normalized();
        double largest = 0;
        for (const Eigen::Vector2d& way : {out, Eigen::Vector2d(-out.y(), out.x())}) {
          const double step = 1e-3;
          const Eigen::Vector3d there = ray(at + step * way).normalized();
          largest = std::max(largest, here.cross(there).norm() / step);
        }
        const double stated = map.in_picture(at)->stretch * here.z() / fisheye.photograph.fx;
        EXPECT_NEAR(stated, largest, 1e-3 * largest) << k1 << ' ' << u << ' ' << v;
      }
    }
  }
}

TEST(FisheyeMap, ShowsTheSameOfPhotographsOfAnotherSize) {
  Fisheye fisheye = lens();
  fisheye.radius = 190;
  const FisheyeMap map(fisheye);
  const FisheyeMap larger = map.resized(1200, 900);
  EXPECT_EQ(larger.picture().width, 3 * map.picture().width);
  for (double x = 0.5; x < map.picture().width; x += 29) {
    for (double y = 0.5; y < map.picture().height; y += 23) {
      const Eigen::Vector2d at = map.in_photograph({x, y});
      EXPECT_LT((larger.in_photograph({3 * x, 3 * y}) - 3 * at).norm(), 1e-9) << x << ' ' << y;
      EXPECT_EQ(larger.shows(3 * at), map.shows(at));
    }
  }
}

TEST(FisheyeMap, HasTheTangentialTermsOfBrownInAngles) {
  Fisheye fisheye = lens();
  fisheye.p = {0.01, -0.02};
  const FisheyeMap map(fisheye);
  const double angle = 0.8;
  const double phi = 0.6;
  const double x = angle * std::cos(phi);
  const double y = angle * std::sin(phi);
  const double s = angle * angle;
  const double d = 1 - 0.03 * s + 0.012 * s * s - 0.006 * s * s * s + 0.001 * s * s * s * s;
  const double u = x * d + 2 * 0.01 * x * y - 0.02 * (s + 2 * x * x);
  const double v = y * d + 0.01 * (s + 2 * y * y) - 2 * 0.02 * x * y;
  const Camera& c = map.picture();
  const Eigen::Vector2d at(c.fx * std::tan(angle) * std::cos(phi) + c.cx,
                           c.fy * std::tan(angle) * std::sin(phi) + c.cy);
  EXPECT_LT((map.in_photograph(at) - Eigen::Vector2d(205 * u + 203.3, 203 * v + 147.6)).norm(),
            1e-9);
}

// Of an ideal lens the angles of the outermost pixels on the axes are known: pixels / f.
TEST(FisheyeMap, ReachesAsFarAsThePhotographOnItsAxes) {
  const Fisheye ideal{
      {.width = 380, .height = 300, .fx = 200, .fy = 200, .cx = 180, .cy = 150}, {}, {}, 0};
  const FisheyeMap map(ideal);
  EXPECT_NEAR(map.picture().width, 200 * (std::tan(0.8975) + std::tan(0.9975)), 0.5);
  EXPECT_FALSE(map.is_cropped());
  EXPECT_EQ(map.picture().fx, 200);
  EXPECT_NEAR(map.picture().cx, 200 * std::tan(0.8975), 1e-9);
  EXPECT_NEAR(map.picture().height, 2 * 200 * std::tan(0.7475), 0.5);
}

TEST(FisheyeMap, EndsAtSixtyDegrees) {
  const Fisheye wide{{.width = 400, .height = 300, .fx = 110, .fy = 110, .cx = 200, .cy = 150},
                     {},
                     {},
                     0};  // 104 degrees to the left and to the right
  const FisheyeMap map(wide);
  EXPECT_TRUE(map.is_cropped());
  const Camera& picture = map.picture();
  EXPECT_NEAR(std::atan2(picture.cx, picture.fx), 60 * kDegree, 1e-12);
  EXPECT_NEAR(picture.width, 2 * 110 * std::tan(60 * kDegree), 0.5);
  EXPECT_TRUE(map.in_picture({200 + 110 * 80 * kDegree, 150})) << "beside the picture";
  EXPECT_FALSE(map.in_picture({200 + 110 * 90 * kDegree, 150}));
  EXPECT_FALSE(map.in_picture({399, 150}));
}

TEST(FisheyeMap, KnowsWhereALensFolds) {
  Fisheye folding = lens();
  folding.k = {-0.5, 0, 0, 0};  // turns back at 0.816, where it reaches 0.544
  const FisheyeMap map(folding);
  EXPECT_TRUE(map.in_picture({203.3 + 205 * 0.54, 147.6}));
  EXPECT_FALSE(map.in_picture({203.3 + 205 * 0.55, 147.6}));
  const Camera& c = map.picture();
  EXPECT_FALSE(map.in_photograph({c.cx + c.fx * std::tan(0.82), c.cy}).allFinite());
  EXPECT_TRUE(map.in_photograph({c.cx + c.fx * std::tan(0.81), c.cy}).allFinite());
}

TEST(CheckFisheye, RefusesWhatCannotBeUndone) {
  const auto defect = [](const Fisheye& fisheye) {
    return test::defect_of([&] {
      check_fisheye(fisheye,
                    [](Defect d, const std::string& why) { throw BadInput(d, "lens", why); });
    });
  };
  EXPECT_EQ(defect(lens()), "");
  Fisheye bad = lens();
  bad.k = {-0.5, 0, 0, 0};
  EXPECT_EQ(defect(bad), "VALUE") << "folds inside the picture";
  bad.k = {0, std::numeric_limits<double>::quiet_NaN(), 0, 0};
  EXPECT_EQ(defect(bad), "VALUE");
  bad = lens();
  bad.p[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(defect(bad), "VALUE");
  bad = lens();
  bad.k = {-1e308, 0, 0, 0};
  EXPECT_EQ(defect(bad), "VALUE");
  bad.k = {-0.5, 0, 0, 1e-150};
  EXPECT_EQ(defect(bad), "VALUE") << "folds inside the picture";
  bad = lens();
  bad.photograph.fx = 0;
  EXPECT_EQ(defect(bad), "VALUE");
  bad = lens();
  bad.photograph.cx = -300;  // everything is more than 84 degrees to the right
  EXPECT_EQ(defect(bad), "VALUE");
  bad = lens();
  bad.radius = -1;
  EXPECT_EQ(defect(bad), "VALUE");
  bad = lens();
  bad.photograph.fx = bad.photograph.fy = 90;  // far more than 180 degrees
  EXPECT_EQ(defect(bad), "");
}

// A smooth picture over directions.
Eigen::Vector3f colour(const Eigen::Vector3d& ray) {
  const Eigen::Vector3d d = ray.normalized();
  return (0.5 + 0.4 * (Eigen::Vector3d(11, 7, 9).cwiseProduct(d)).array().sin())
      .matrix()
      .cast<float>();
}

// What the lens records of it, by OpenCV's inverse.
ColorImage photograph(const Fisheye& fisheye) {
  const Camera& c = fisheye.photograph;
  ColorImage image(c.width, c.height, Eigen::Vector3f::Zero());
  std::vector<cv::Point2d> at;
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < c.width; ++x) at.emplace_back(x, y);
  }
  std::vector<cv::Point2d> rays;
  cv::fisheye::undistortPoints(at, rays, intrinsics(c), cv::Vec4d(fisheye.k.data()));
  for (size_t i = 0; i < rays.size(); ++i) image.data[i] = colour({rays[i].x, rays[i].y, 1});
  return image;
}

TEST(UndistortFisheye, RecoversWhatAPinholeCameraWouldHaveSeen) {
  const FisheyeMap map(lens());
  ColorImage image = photograph(lens());
  MaskMap valid;
  undistort(image, valid, map);
  const Camera& picture = map.picture();
  ASSERT_EQ(image.width, picture.width);
  ASSERT_EQ(image.height, picture.height);
  int used = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!valid.empty() && valid(x, y) == 0) continue;
      ++used;
      const Eigen::Vector3f expected = colour(picture.ray_in_cam(x + 0.5, y + 0.5));
      ASSERT_LT((image(x, y) - expected).cwiseAbs().maxCoeff(), 2e-3) << x << ' ' << y;
    }
  }
  EXPECT_GT(used, 0.98 * image.width * image.height);
}

TEST(UndistortFisheye, CarriesTheMaskAlongAndStopsAtTheImageCircle) {
  Fisheye fisheye = lens();
  const FisheyeMap map(fisheye);
  const Camera& picture = map.picture();
  const Eigen::Vector2d masked = map.in_picture({330.5, 200.5})->at;
  const Eigen::Vector2d free = map.in_picture({330.5, 100.5})->at;
  const Eigen::Vector2d edge = map.in_picture({20.5, 150.5})->at;
  for (const double radius : {0.0, 160.0}) {
    fisheye.radius = radius;
    ColorImage image = photograph(fisheye);
    MaskMap valid(400, 300, 1);
    for (int y = 190; y < 210; ++y) {
      for (int x = 320; x < 340; ++x) valid(x, y) = 0;
    }
    undistort(image, valid, FisheyeMap(fisheye));
    ASSERT_EQ(valid.width, picture.width);
    EXPECT_EQ(valid(int(masked.x()), int(masked.y())), 0);
    EXPECT_EQ(valid(int(free.x()), int(free.y())), 1);
    EXPECT_EQ(valid(int(edge.x()), int(edge.y())), radius == 0 ? 1 : 0);
  }
}

}  // namespace
}  // namespace cgs::fisheye_map_test
