// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/gaussians.h"

#include <cmath>

#include <gtest/gtest.h>

namespace cgs::gaussians_test {
namespace {

TEST(RotationMatrix, IsOrthonormalForAnyQuaternionLength) {
  for (const float length : {1e-23f, 1e-10f, 1.0f, 1e10f, 1e20f}) {
    const Eigen::Matrix3f R = rotation_matrix(length * Eigen::Vector4f(0.5f, -0.1f, 0.7f, 0.2f));
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3f::Identity()).norm(), 1e-6f) << length;
  }
}

TEST(RotationMatrix, OfZeroIsIdentity) {
  EXPECT_EQ(rotation_matrix(Eigen::Vector4f::Zero()), Eigen::Matrix3f::Identity());
}

TEST(Covariance, HasTheScalesAsStandardDeviations) {
  // A quarter turn about z maps local x to world y.
  const Eigen::Vector4f quarter_turn(std::sqrt(0.5f), 0, 0, std::sqrt(0.5f));
  const Eigen::Matrix3f C = covariance({1, 2, 3}, quarter_turn);
  const Eigen::Matrix3f expected = Eigen::Vector3f(4, 1, 9).asDiagonal();
  EXPECT_LT((C - expected).norm(), 1e-5f);
}

}  // namespace
}  // namespace cgs::gaussians_test
