// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/resample.h"

#include <cmath>

#include <gtest/gtest.h>

namespace cgs::resample_test {
namespace {

// A smooth picture defined on undistorted image coordinates, slow enough to be interpolated well.
Eigen::Vector3f scene_color(double u, double v) {
  return {float(0.5 + 0.4 * std::sin(u / 11)),
          float(0.5 + 0.4 * std::cos(v / 13)),
          float(0.5 + 0.4 * std::sin((u + 2 * v) / 17))};
}

// The Brown-Conrady model written down once more, as an oracle.
Eigen::Vector2d distorted(double x, double y, const std::array<double, 5>& d) {
  const double r2 = x * x + y * y;
  const double radial = 1 + d[0] * r2 + d[1] * r2 * r2 + d[4] * r2 * r2 * r2;
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

// Undistorted ray of a distorted one, by bisection-free fixed-point iteration run to convergence.
Eigen::Vector2d undistorted(const Eigen::Vector2d& target, const std::array<double, 5>& d) {
  Eigen::Vector2d p = target;
  for (int i = 0; i < 200; ++i) p += target - distorted(p.x(), p.y(), d);
  return p;
}

// What a camera with that lens records of scene_color.
ColorImage photograph(const Camera& camera, const std::array<double, 5>& d) {
  ColorImage image(camera.width, camera.height, Eigen::Vector3f::Zero());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d p = undistorted(camera.ray_in_cam(x + 0.5, y + 0.5).head<2>(), d);
      image(x, y) = scene_color(camera.fx * p.x() + camera.cx, camera.fy * p.y() + camera.cy);
    }
  }
  return image;
}

const Camera kCamera{.width = 120, .height = 90, .fx = 100, .fy = 104, .cx = 63.7, .cy = 41.2};

TEST(Undistort, RecoversWhatAPinholeCameraWouldHaveSeen) {
  for (const std::array<double, 5> d :
       {std::array<double, 5>{-0.2, 0.05, 0.004, -0.006, 0.01}, {0.15, -0.02, -0.003, 0.002, 0}}) {
    ColorImage image = photograph(kCamera, d);
    MaskMap valid;
    undistort(image, valid, kCamera, d);
    double worst = 0;
    double worst_inside = 0;
    int used = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        if (!valid.empty() && valid(x, y) == 0) continue;
        ++used;
        const Eigen::Vector3f error = image(x, y) - scene_color(x + 0.5, y + 0.5);
        worst = std::max(worst, double(error.cwiseAbs().maxCoeff()));
        const bool is_inside = x >= 8 && y >= 8 && x < image.width - 8 && y < image.height - 8;
        if (is_inside) worst_inside = std::max(worst_inside, double(error.cwiseAbs().maxCoeff()));
      }
    }
    // Linear at the rim, cubic inside; half a pixel of shift would give 0.02 and more.
    EXPECT_LT(worst, 1e-3);
    EXPECT_LT(worst_inside, 1e-4);
    EXPECT_GT(used, 9 * image.width * image.height / 10 * 9 / 10);
  }
}

TEST(Undistort, MarksWhatThePhotographDoesNotReach) {
  const std::array<double, 5> pincushion = {0.4, 0, 0, 0, 0};
  ColorImage image = photograph(kCamera, pincushion);
  MaskMap valid;
  undistort(image, valid, kCamera, pincushion);
  ASSERT_FALSE(valid.empty());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = kCamera.ray_in_cam(x + 0.5, y + 0.5);
      const Eigen::Vector2d p = distorted(ray.x(), ray.y(), pincushion);
      const double u = kCamera.fx * p.x() + kCamera.cx;
      const double v = kCamera.fy * p.y() + kCamera.cy;
      const double margin =
          std::min(std::min(u, kCamera.width - u), std::min(v, kCamera.height - v));
      if (margin > 0.6) EXPECT_EQ(valid(x, y), 1) << x << " " << y;
      if (margin < 0.4) EXPECT_EQ(valid(x, y), 0) << x << " " << y;
    }
  }
}

TEST(Undistort, MarksPixelsBeyondTheFold) {
  const std::array<double, 5> folding = {-1.0, 0, 0, 0, 0};  // folds at r = 0.577, reaches 0.385
  ColorImage image(kCamera.width, kCamera.height, Eigen::Vector3f::Constant(0.5f));
  MaskMap valid;
  undistort(image, valid, kCamera, folding);
  ASSERT_FALSE(valid.empty());
  EXPECT_EQ(valid(0, 0), 0) << "radius above the fold would mirror the picture";
  EXPECT_EQ(valid(63, 41), 1);
}

TEST(Undistort, CarriesTheMaskAlong) {
  ColorImage image(kCamera.width, kCamera.height, Eigen::Vector3f::Constant(0.5f));
  MaskMap valid(kCamera.width, kCamera.height, 1);
  for (int y = 0; y < 90; ++y) valid(30, y) = 0;
  undistort(image, valid, kCamera, {-0.1, 0, 0, 0, 0});
  ASSERT_FALSE(valid.empty());
  EXPECT_EQ(valid(30, 41), 0);
  EXPECT_EQ(valid(60, 41), 1);
}

TEST(Undistorted, IsExactForStrongLensesToTheCorners) {
  for (const std::array<double, 5> d :
       {std::array<double, 5>{-0.3, 0.08, 0.004, -0.006, 0.01}, {0.4, -0.02, -0.003, 0.002, 0}}) {
    for (const Eigen::Vector2d truth : {Eigen::Vector2d(1, 1), {119, 89}, {60, 3}, {30, 80}}) {
      const Eigen::Vector2d ray = kCamera.ray_in_cam(truth.x(), truth.y()).head<2>();
      const Eigen::Vector2d bent = distorted(ray.x(), ray.y(), d);
      const Eigen::Vector2d at = {kCamera.fx * bent.x() + kCamera.cx,
                                  kCamera.fy * bent.y() + kCamera.cy};
      const Eigen::Vector2d found = cgs::undistorted(at, kCamera, d);
      EXPECT_LT((found - truth).norm(), 1e-5);
      EXPECT_TRUE(is_undone(at, found, kCamera, d));
    }
  }
}

TEST(Undistorted, IsNotThereBeyondTheFold) {
  const std::array<double, 5> folding = {-1.0, 0, 0, 0, 0};  // folds at r = 0.577, reaches 0.385
  for (const double r : {0.3, 0.38, 0.39, 0.5}) {
    const Eigen::Vector2d at = {kCamera.cx - 100 * r, kCamera.cy};
    EXPECT_EQ(is_undone(at, cgs::undistorted(at, kCamera, folding), kCamera, folding), r < 0.385);
  }
}

TEST(AreaDownscale, AveragesBlocks) {
  ColorImage image(4, 2, Eigen::Vector3f::Zero());
  for (int x = 0; x < 4; ++x) image(x, 0) = Eigen::Vector3f::Constant(0.25f * float(x));
  MaskMap valid;
  area_downscale(image, valid, 2, 1);
  EXPECT_NEAR(image(0, 0)[0], 0.0625f, 1e-6f);
  EXPECT_NEAR(image(1, 0)[0], 0.3125f, 1e-6f);
  EXPECT_TRUE(valid.empty());
}

TEST(AreaDownscale, LeavesMaskedPixelsOutOfTheAverage) {
  ColorImage image(4, 2, Eigen::Vector3f::Constant(0.5f));
  MaskMap valid(4, 2, 1);
  image(0, 0) = image(2, 0) = image(2, 1) = image(3, 1) = Eigen::Vector3f::Ones();
  valid(0, 0) = valid(2, 0) = valid(2, 1) = valid(3, 1) = 0;
  area_downscale(image, valid, 2, 1);
  EXPECT_NEAR(image(0, 0)[0], 0.5f, 1e-6f);
  EXPECT_EQ(valid.data, (std::vector<uint8_t>{1, 0}));
}

}  // namespace
}  // namespace cgs::resample_test
