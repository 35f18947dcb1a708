// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/up_axis.h"

#include <limits>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::up_axis_test {
namespace {

const std::vector<Eigen::Vector3d>& directions() {
  static const std::vector<Eigen::Vector3d> kAll = {{1, 0, 0},
                                                    {-1, 0, 0},
                                                    {0, 1, 0},
                                                    {0, -1, 0},
                                                    {0, 0, 1},
                                                    {0, 0, -1},
                                                    {1, 2, 3},
                                                    {-9, 0.1, 0.2},
                                                    {1e-200, 1e-200, 0},
                                                    {1e200, 0, -1e200}};
  return kAll;
}

TEST(UpAxis, TakesUpToItsAxisByAProperRotation) {
  for (const Eigen::Vector3d& up : directions()) {
    const Eigen::Vector3d unit = up.stableNormalized();
    for (const Eigen::Matrix3d& R : {z_up_from(up), y_up_from(up)}) {
      EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_NEAR(R.determinant(), 1, 1e-12);
    }
    EXPECT_LT((z_up_from(up) * unit - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_LT((y_up_from(up) * unit - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  }
}

TEST(UpAxis, LeavesAWorldAloneThatIsUprightAlready) {
  EXPECT_EQ(z_up_from(Eigen::Vector3d::UnitZ()), Eigen::Matrix3d::Identity());
  EXPECT_EQ(y_up_from(Eigen::Vector3d::UnitY()), Eigen::Matrix3d::Identity());
}

TEST(UpAxis, TurnsCameraAxesIntoThoseOfGltf) {
  // +x right, +y down, +z forward becomes +x right, +y up, +z backward.
  const Eigen::Matrix3d expected = Eigen::Vector3d(1, -1, -1).asDiagonal();
  EXPECT_LT((y_up_from({0, -1, 0}) - expected).norm(), 1e-15);
}

TEST(UpAxis, RefusesADirectionThatIsNone) {
  EXPECT_THROW(z_up_from(Eigen::Vector3d::Zero()), InvalidInput);
  EXPECT_THROW(y_up_from({0, std::numeric_limits<double>::quiet_NaN(), 1}), InvalidInput);
  EXPECT_THROW(y_up_from({0, std::numeric_limits<double>::infinity(), 1}), InvalidInput);
}

}  // namespace
}  // namespace cgs::up_axis_test
