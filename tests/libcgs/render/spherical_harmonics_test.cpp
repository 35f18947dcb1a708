// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/spherical_harmonics.h"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace cgs::spherical_harmonics_test {
namespace {

using Coefficients = std::array<Eigen::Vector3f, 16>;

Coefficients zeros() {
  Coefficients c;
  c.fill(Eigen::Vector3f::Zero());
  return c;
}

// Basis function k without clamping: small coefficients stay above -0.5.
float basis(int k, const Eigen::Vector3f& direction) {
  Coefficients c = zeros();
  c[k].setConstant(0.125f);
  return (sh_color(c, 3, direction).x() - 0.5f) / 0.125f;
}

TEST(ShColor, OfDegreeZeroIsTheConstantTerm) {
  Coefficients c = zeros();
  c[0] = {1, -1, 2};
  const float y00 = 0.5f * std::sqrt(1 / float(M_PI));
  const Eigen::Vector3f color = sh_color(c, 0, {0, 0, 1});
  EXPECT_FLOAT_EQ(color.x(), 0.5f + y00);
  EXPECT_FLOAT_EQ(color.y(), 0.5f - y00);
  EXPECT_FLOAT_EQ(color.z(), 0.5f + 2 * y00);
}

TEST(ShColor, HasTheSignsOf3dgsFiles) {
  const float s = std::sqrt(0.5f);
  EXPECT_LT(basis(1, {0, 1, 0}), 0);  // -y
  EXPECT_GT(basis(2, {0, 0, 1}), 0);  // +z
  EXPECT_LT(basis(3, {1, 0, 0}), 0);  // -x
  EXPECT_GT(basis(4, {s, s, 0}), 0);  // +xy
  EXPECT_LT(basis(5, {0, s, s}), 0);  // -yz
  EXPECT_GT(basis(6, {0, 0, 1}), 0);  // +(3zz - 1)
  EXPECT_LT(basis(7, {s, 0, s}), 0);  // -xz
  EXPECT_GT(basis(8, {1, 0, 0}), 0);  // +(xx - yy)
  EXPECT_GT(basis(9, {0, 1, 0}), 0);  // -y(3xx - yy)
  EXPECT_GT(basis(12, {0, 0, 1}), 0);
  EXPECT_LT(basis(11, {0, s, s}), 0);
  EXPECT_LT(basis(13, {s, 0, s}), 0);
  EXPECT_LT(basis(15, {1, 0, 0}), 0);  // -x(xx - 3yy)
}

TEST(ShColor, HasAnOrthonormalBasis) {
  // Gauss-Legendre in z (exact to degree 9) times equal steps in azimuth (exact to degree 7).
  constexpr std::array<double, 5> kNodes = {
      -0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, 5> kWeights = {0.2369268850561891,
                                              0.4786286704993665,
                                              0.5688888888888889,
                                              0.4786286704993665,
                                              0.2369268850561891};
  constexpr int kSteps = 8;
  for (int j = 1; j < 16; ++j) {
    for (int k = j; k < 16; ++k) {
      double sum = 0;
      for (size_t i = 0; i < kNodes.size(); ++i) {
        const double r = std::sqrt(1 - kNodes[i] * kNodes[i]);
        for (int step = 0; step < kSteps; ++step) {
          const double azimuth = 2 * M_PI * step / kSteps;
          const Eigen::Vector3f d =
              Eigen::Vector3d(r * std::cos(azimuth), r * std::sin(azimuth), kNodes[i])
                  .cast<float>();
          sum += kWeights[i] * 2 * M_PI / kSteps * double(basis(j, d)) * double(basis(k, d));
        }
      }
      EXPECT_NEAR(sum, j == k ? 1.0 : 0.0, 2e-5) << j << ", " << k;
    }
  }
}

TEST(ShColor, IsNeverNegative) {
  Coefficients c = zeros();
  c[0].setConstant(-10);
  EXPECT_EQ(sh_color(c, 3, {0, 0, 1}), Eigen::Vector3f::Zero());
}

TEST(ShColor, StaysFiniteForHugeCoefficientsAndBadDirections) {
  Coefficients c;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float size : {1e30f, -1e30f}) {
    c.fill(Eigen::Vector3f::Constant(size));
    EXPECT_TRUE(sh_color(c, 3, Eigen::Vector3f(1, 2, 3).normalized()).allFinite());
  }
  c.fill(Eigen::Vector3f::Constant(0.25f));
  const Eigen::Vector3f constant_term = sh_color(c, 0, {0, 0, 1});
  EXPECT_EQ(sh_color(c, 3, Eigen::Vector3f::Zero()), constant_term);
  EXPECT_EQ(sh_color(c, 3, Eigen::Vector3f::Constant(nan)), constant_term);
}

TEST(ShBasis, GivesTheColourAndItsSlope) {
  Coefficients c;
  for (size_t k = 0; k < c.size(); ++k) c[k].setConstant(0.1f * float(k % 5) - 0.17f);
  const Eigen::Vector3f direction = Eigen::Vector3f(1, -2, 3).normalized();
  for (const int degree : {0, 1, 2, 3}) {
    const auto color = [&](const ShBasis& basis) {
      float sum = 0.5f;
      for (size_t k = 0; k < c.size(); ++k) sum += basis.value[k] * c[k].x();
      return sum;
    };
    const ShBasis basis = sh_basis(degree, direction);
    EXPECT_NEAR(color(basis), sh_color(c, degree, direction).x(), 1e-6f);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3f step = 0.01f * Eigen::Vector3f::Unit(axis);
      float slope = 0;
      for (size_t k = 0; k < c.size(); ++k) slope += basis.slope[k][axis] * c[k].x();
      const float difference =
          color(sh_basis(degree, direction + step)) - color(sh_basis(degree, direction - step));
      EXPECT_NEAR(slope, difference / 0.02f, 1e-3f) << degree << ", " << axis;
    }
  }
  EXPECT_EQ(sh_basis(3, Eigen::Vector3f::Zero()).value[6], 0);
}

}  // namespace
}  // namespace cgs::spherical_harmonics_test
