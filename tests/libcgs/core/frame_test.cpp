// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/frame.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::frame_test {
namespace {

std::vector<Eigen::Vector3d> cloud(double scale, const Eigen::Vector3d& offset) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : {Eigen::Vector3d(0.1, 0.2, 0.3),
                        Eigen::Vector3d(1.7, -0.4, 0.9),
                        Eigen::Vector3d(0.5, 1.25, -2.0)}) {
    points.push_back(scale * p + offset);
  }
  return points;
}

TEST(CanonicalFrame, ExtentComesToLieBetweenOneHalfAndOne) {
  for (const double scale : {1e-6, 0.3, 1.0, 7.0, 1e6}) {
    const auto points = cloud(scale, Eigen::Vector3d(3, 2, 1));
    const Frame frame = canonical_frame(points);
    Eigen::AlignedBox3d box;
    for (const auto& p : points) box.extend(frame.internal_from_world(p));
    EXPECT_GE(box.sizes().maxCoeff(), 0.5);
    EXPECT_LT(box.sizes().maxCoeff(), 1.0);
  }
}

TEST(CanonicalFrame, InternalNumbersAreBitIdenticalUnderPowerOfTwoScaling) {
  const auto base = cloud(1, Eigen::Vector3d::Zero());
  const Frame frame = canonical_frame(base);
  for (const int k : {-20, -10, -1, 1, 10, 20}) {
    const auto scaled = cloud(std::ldexp(1.0, k), Eigen::Vector3d::Zero());
    const Frame scaled_frame = canonical_frame(scaled);
    for (size_t i = 0; i < base.size(); ++i) {
      EXPECT_EQ(frame.internal_from_world(base[i]), scaled_frame.internal_from_world(scaled[i]));
    }
  }
}

TEST(CanonicalFrame, InternalNumbersAreBitIdenticalWhereverTheSceneIs) {
  // Halves of the grid that origins snap to, where rounding must not depend on the sign.
  const std::vector<Eigen::Vector3d> base = {{0, 0, 0}, {1 + 0x1p-10, 0.5, 0.25 + 0x1p-10}};
  const Frame frame = canonical_frame(base);
  for (const Eigen::Vector3d& move : {Eigen::Vector3d(-2.49e6, -4.68e6, 3.53e6),
                                      Eigen::Vector3d(4.5e5, 5.4e6, 100),
                                      Eigen::Vector3d(-2, -2, -2)}) {
    const Frame moved = canonical_frame({base[0] + move, base[1] + move});
    for (const Eigen::Vector3d& p : base) {
      EXPECT_EQ(frame.internal_from_world(p), moved.internal_from_world(p + move));
    }
  }
}

TEST(SignificantBits, AreStepsOfTheFarthestCoordinate) {
  const auto bits = [](double extent, double place, int digits) {
    const Eigen::Vector3d low(place, 0, 0);
    return significant_bits({low, low + Eigen::Vector3d(extent, extent / 2, 0)}, digits);
  };
  EXPECT_EQ(bits(1, 0x1p20, 53), 32);  // in steps of 2^-32
  EXPECT_EQ(bits(1, 0x1p20, 24), 3);
  EXPECT_EQ(bits(1, -0x1.8p20, 24), 3);
  EXPECT_EQ(bits(1024, 0x1p20, 24), 13);
  EXPECT_EQ(bits(0, 5, 24), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(bits(0, 0, 24), -std::numeric_limits<double>::infinity());
}

TEST(CanonicalFrame, FarScenesKeepTheirDetailInFiles) {
  const Eigen::Vector3d utm(4.5e5, 5.4e6, 100);
  const auto points = cloud(1, utm);
  const Frame frame = canonical_frame(points);
  for (const auto& p : points) {
    const Eigen::Vector3f stored =
        frame.file_from_internal(frame.internal_from_world(p)).cast<float>();
    const Eigen::Vector3d read = stored.cast<double>() + frame.file_origin;
    EXPECT_LT((read - p).norm(), 1e-6);
  }
}

TEST(Frame, InMetresPutsPointsWhereTheyWereSeenByTheMetre) {
  Frame frame = canonical_frame(cloud(1, {30, -20, 5}));
  EXPECT_THROW(in_metres(frame), InvalidInput);
  frame.metres_per_unit = 0.3;
  frame.metres_sigma = 0.003;
  frame.file_origin = {28, 0, 0};
  const Frame metric = in_metres(frame);
  const Eigen::Vector3d p(0.1, -0.2, 0.3);
  EXPECT_LT((metric.world_from_internal(p) - 0.3 * frame.world_from_internal(p)).norm(), 1e-14);
  EXPECT_LT((metric.file_from_internal(p) - 0.3 * frame.file_from_internal(p)).norm(), 1e-14);
  EXPECT_EQ(metric.unit_name(), "m");
  EXPECT_DOUBLE_EQ(metric.metres_sigma, 0.01);
}

TEST(CanonicalFrame, NearScenesKeepTheirWorldCoordinatesInFiles) {
  EXPECT_EQ(canonical_frame(cloud(1, Eigen::Vector3d(3, 2, 1))).file_origin.norm(), 0);
}

TEST(CanonicalFrame, RefusesNoPointsAndNonFinitePoints) {
  EXPECT_THROW(canonical_frame({}), InvalidInput);
  EXPECT_THROW(canonical_frame({Eigen::Vector3d(0, std::nan(""), 0)}), InvalidInput);
}

TEST(CanonicalFrame, OnePointIsAFrameOfScaleOne) {
  EXPECT_EQ(canonical_frame({Eigen::Vector3d(5, 5, 5)}).scale, 1.0);
}

TEST(Frame, NamesItsUnit) {
  Frame frame;
  EXPECT_EQ(frame.unit_name(), "unknown");
  frame.metres_per_unit = 1e-3;
  EXPECT_EQ(frame.unit_name(), "mm");
  frame.metres_per_unit = 2.5;
  EXPECT_EQ(frame.unit_name(), "2.5 m");
}

}  // namespace
}  // namespace cgs::frame_test
