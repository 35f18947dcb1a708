// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/gaussians.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/sample_splats.h"

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

TEST(Append, KeepsWhatIsMadeUpApart) {
  Gaussians all = test::varied_splats(3, 1);
  Gaussians made_up = test::varied_splats(2, 0);
  made_up.synthetic = {1, 0};
  made_up.synthetic_sources = {{"a.png", "1"}};
  append(all, made_up);
  append(all, made_up);
  ASSERT_EQ(all.size(), 7u);
  EXPECT_EQ(all.synthetic, (std::vector<uint8_t>{0, 0, 0, 1, 0, 2, 0}));
  EXPECT_EQ(synthetic_count(all), 2u);
  EXPECT_EQ(all.synthetic_sources.size(), 2u);
  ASSERT_EQ(all.sh.size(), 28u);
  EXPECT_EQ(all.sh[12], made_up.sh[0]);
  for (size_t k = 13; k < 16; ++k) EXPECT_EQ(all.sh[k], Eigen::Vector3f::Zero());
  EXPECT_EQ(all.position[4], made_up.position[1]);
  EXPECT_THROW(append(made_up, test::varied_splats(1, 2)), InvalidInput);
}

TEST(Append, KeepsLabelsWhereBothHaveThem) {
  Gaussians labelled = test::varied_splats(2, 0);
  labelled.provenance.assign(2, Provenance::Observed);
  Gaussians all = labelled;
  append(all, labelled);
  EXPECT_EQ(all.provenance.size(), 4u);
  append(all, test::varied_splats(1, 0));
  EXPECT_TRUE(all.provenance.empty());
  Gaussians none;
  append(none, labelled);
  EXPECT_EQ(none.provenance, labelled.provenance);
}

// As a painted picture is from which nothing could be lifted.
TEST(Append, OfNothingAddsItsSourceAndTakesNoLabels) {
  Gaussians all = test::varied_splats(2, 0);
  all.provenance.assign(2, Provenance::Observed);
  Gaussians nothing;
  nothing.synthetic_sources = {{"a.png", "1"}};
  append(all, nothing);
  EXPECT_EQ(all.provenance, std::vector<Provenance>(2, Provenance::Observed));
  EXPECT_EQ(all.synthetic_sources.size(), 1u);
  EXPECT_EQ(all.size(), 2u);
}

}  // namespace
}  // namespace cgs::gaussians_test
