// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/mesh_arrays.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"

namespace cgs {
namespace {

TEST(ColorByte, RoundsAndClamps) {
  for (int i = 0; i < 256; ++i) EXPECT_EQ(color_byte(static_cast<float>(i) / 255.0f), i);
  EXPECT_EQ(color_byte(-3), 0);
  EXPECT_EQ(color_byte(3), 255);
  EXPECT_EQ(color_byte(std::nanf("")), 0);
}

TEST(LinearFromSrgb, AgreesWithTheStandard) {
  EXPECT_EQ(linear_from_srgb(0), 0.0f);
  EXPECT_FLOAT_EQ(linear_from_srgb(1), 1.0f);
  EXPECT_NEAR(linear_from_srgb(0.5f), 0.2140411, 1e-6);
  EXPECT_NEAR(linear_from_srgb(0.04f), 0.04 / 12.92, 1e-8);
  EXPECT_EQ(linear_from_srgb(-0.5f), -linear_from_srgb(0.5f));
  EXPECT_GT(linear_from_srgb(1.5f), 2.0f);
}

TEST(Millimetres, ConvertsFileCoordinates) {
  const Eigen::Vector3d p =
      millimetres({0.5f, 0, 0}, test::centimetre_frame(), Eigen::Matrix3d::Identity());
  EXPECT_LT((p - Eigen::Vector3d(10 * (0.5 + 32), 10 * -0.25, 0)).norm(), 1e-9);
}

TEST(ProvenanceName, NamesEveryClassOnce) {
  std::string all;
  for (const Provenance label : kProvenanceOrder) all += std::string(provenance_name(label)) + ";";
  EXPECT_EQ(all, "observed;single view;interpolated;inferred;");
}

}  // namespace
}  // namespace cgs
