// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/camera_checks.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"

namespace cgs::camera_checks_test {
namespace {

using test::defect_of;

[[noreturn]] void refuse(Defect defect, const std::string& reason) {
  throw BadInput(defect, "f", reason);
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(CheckedPose, KeepsRotationsBitForBit) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  const Eigen::Isometry3d pose = checked_pose(R, {5e6, 4, 3}, refuse);
  EXPECT_EQ(pose.linear(), R);
  EXPECT_EQ(pose.translation(), Eigen::Vector3d(5e6, 4, 3));
}

TEST(CheckedPose, RoundsToTheNearestRotation) {
  Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).matrix();
  R(0, 1) += 3e-4;
  const Eigen::Matrix3d out = checked_pose(R, {0, 0, 0}, refuse).linear();
  EXPECT_LT((out.transpose() * out - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((out - R).norm(), 3e-4);
}

TEST(CheckedPose, RefusesWhatIsNoRotation) {
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, 1, -1).asDiagonal();
  EXPECT_EQ(defect_of([&] { checked_pose(mirror, zero, refuse); }), "VALUE");
  EXPECT_EQ(defect_of([&] { checked_pose(1.01 * I, zero, refuse); }), "VALUE");
  EXPECT_EQ(defect_of([&] { checked_pose(0 * I, zero, refuse); }), "VALUE");
  EXPECT_EQ(defect_of([&] { checked_pose(kNan * I, zero, refuse); }), "VALUE");
  EXPECT_EQ(defect_of([&] { checked_pose(I, {0, kNan, 0}, refuse); }), "VALUE");
}

TEST(CheckIntrinsics, RefusesEachFieldOutOfRange) {
  const Camera good{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  EXPECT_NO_THROW(check_intrinsics(good, refuse));
  const auto refused = [&](double Camera::*field, double value) {
    Camera bad = good;
    bad.*field = value;
    return defect_of([&] { check_intrinsics(bad, refuse); });
  };
  for (const double value : {0.0, -1.0, kNan, double(INFINITY)}) {
    EXPECT_EQ(refused(&Camera::fx, value), "VALUE") << value;
    EXPECT_EQ(refused(&Camera::fy, value), "VALUE") << value;
  }
  for (const double value : {1e300, kNan, -1e5}) {
    EXPECT_EQ(refused(&Camera::cx, value), "VALUE") << value;
    EXPECT_EQ(refused(&Camera::cy, value), "VALUE") << value;
  }
  Camera empty = good;
  empty.width = 0;
  EXPECT_EQ(defect_of([&] { check_intrinsics(empty, refuse); }), "VALUE");
  Camera huge = good;
  huge.width = huge.height = 1 << 20;
  EXPECT_EQ(defect_of([&] { check_intrinsics(huge, refuse); }), "VALUE");
}

TEST(FoldRadius, IsWhereTheDistortedRadiusStopsGrowing) {
  EXPECT_TRUE(std::isinf(fold_radius({0, 0, 0, 0, 0})));
  EXPECT_TRUE(std::isinf(fold_radius({0.1, 0.02, 0, 0, 0.01})));
  EXPECT_NEAR(fold_radius({-1.0 / 3, 0, 0, 0, 0}), 1, 1e-12);  // d/dr (r - r^3 / 3) = 1 - r^2
  for (const std::array<double, 5> d :
       {std::array<double, 5>{-0.3, 0.05, 0, 0, 0}, {0.1, -0.2, 0, 0, 0.01}, {0, 0, 0, 0, -0.4}}) {
    // Slow reference: walk outwards until the radius shrinks.
    const auto distorted = [&](double r) {
      return r * (1 + d[0] * std::pow(r, 2) + d[1] * std::pow(r, 4) + d[4] * std::pow(r, 6));
    };
    double r = 0;
    while (r < 10 && distorted(r + 1e-4) > distorted(r)) r += 1e-4;
    const double fold = fold_radius(d);
    if (r < 10) {
      EXPECT_NEAR(fold, r, 2e-4);
    } else {
      EXPECT_TRUE(fold > 10);
    }
  }
}

TEST(FoldRadius, IsNotMisledByCoefficientsThatDoNothing) {
  using Radial = std::array<double, 4>;
  for (const double nothing : {1e-150, -1e-150, 1e-300, 1e-20}) {
    EXPECT_NEAR(fold_radius(Radial{-0.5, 0, 0, nothing}), std::sqrt(2.0 / 3), 1e-9) << nothing;
    EXPECT_NEAR(fold_radius(Radial{-0.5, nothing, 0, 0}), std::sqrt(2.0 / 3), 1e-9) << nothing;
  }
  EXPECT_TRUE(std::isinf(fold_radius(Radial{0.1, 0, 0, 1e-150})));
  EXPECT_TRUE(std::isinf(fold_radius(Radial{1e-30, 1e-30, 10, 1e-30})));
}

TEST(CheckDistortion, RefusesAFoldInsideTheImage) {
  const Camera camera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  EXPECT_NO_THROW(check_distortion(camera, {-0.3, 0.1, 0, 0, 0}, refuse));
  EXPECT_EQ(defect_of([&] { check_distortion(camera, {-10, 0, 0, 0, 0}, refuse); }), "VALUE");
  EXPECT_EQ(defect_of([&] { check_distortion(camera, {kNan, 0, 0, 0, 0}, refuse); }), "VALUE");
  for (const double huge : {-1e308, 1e308, -1e30}) {
    EXPECT_EQ(defect_of([&] { check_distortion(camera, {huge, 0, 0, 0, 0}, refuse); }), "VALUE");
  }
}

}  // namespace
}  // namespace cgs::camera_checks_test
