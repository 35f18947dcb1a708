// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/mesh_arrays.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"

namespace cgs::mesh_arrays_test {
namespace {

TEST(ColorByte, RoundsAndClamps) {
  for (int i = 0; i < 256; ++i) EXPECT_EQ(color_byte(static_cast<float>(i) / 255.0f), i);
  EXPECT_EQ(color_byte(-3), 0);
  EXPECT_EQ(color_byte(3), 255);
  EXPECT_EQ(color_byte(std::nanf("")), 0);
}

TEST(Millimetres, ConvertsFileCoordinates) {
  const Eigen::Vector3d p =
      millimetres({0.5f, 0, 0}, test::centimetre_frame(), Eigen::Matrix3d::Identity());
  EXPECT_LT((p - Eigen::Vector3d(10 * (0.5 + 32), 10 * -0.25, 0)).norm(), 1e-9);
}

TEST(ProvenanceName, NamesEveryClassOnce) {
  std::string all;
  for (const Provenance label : kProvenanceOrder) all += std::string(provenance_name(label)) + ";";
  EXPECT_EQ(all, "observed;single view;interpolated;estimated;inferred;virtual;");
}

}  // namespace
}  // namespace cgs::mesh_arrays_test
