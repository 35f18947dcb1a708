// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/arch.h"

#include <gtest/gtest.h>

#include "samples/capture/solids.h"

namespace cgs::arch_test {
namespace {

using std::numbers::pi;

TEST(ArchPath, RunsFromJambToJamb) {
  const auto path = arch_path(0.5, 2, 0.02);
  const auto apex = path[path.size() / 2].at({2, 0.3});
  EXPECT_NEAR((path.front().at({2, 0.3}) - Eigen::Vector3d(-2, 0.3, 0.5)).norm(), 0, 1e-9);
  EXPECT_NEAR((path.back().at({2, 0.3}) - Eigen::Vector3d(2, 0.3, 0.5)).norm(), 0, 1e-9);
  EXPECT_NEAR((apex - Eigen::Vector3d(0, 0.3, kSpringing + 2)).norm(), 0, 0.03);
}

TEST(Swept, HasTheVolumeOfHalfARingAndTwoJambs) {
  const auto square = [](double) {
    return std::vector<Eigen::Vector2d>{{1, 0}, {2, 0}, {2, 0.5}, {1, 0.5}};
  };
  const TriangleMesh mesh = swept(arch_path(kSpringing - 1, 2, 0.005), square);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(enclosed_volume(mesh), 0.5 * (pi / 2 * (4 - 1) + 2 * 1), 1e-4);
}

TEST(OrderSection, KeepsItsCornersAndEndsItsOrnamentAtTheJamb) {
  for (int order = 0; order < kOrders; ++order) {
    const auto jamb = order_section(order, -1);
    bool ornate = false;
    for (double along = 0; along < 2; along += 0.013) {
      const auto section = order_section(order, along);
      ASSERT_EQ(section.size(), jamb.size());
      ornate = ornate || section != jamb;
    }
    EXPECT_EQ(ornate, order != 0) << order;  // the outermost is plain
  }
}

TEST(Column, IsClosedAndReachesFromThresholdToImpost) {
  for (uint32_t kind = 0; kind < 4; ++kind) {
    const TriangleMesh mesh = column(kind);
    EXPECT_TRUE(is_closed(mesh));
    float low = 9;
    float high = 0;
    for (const auto& v : mesh.vertices) {
      low = std::min(low, v.z());
      high = std::max(high, v.z());
    }
    EXPECT_LT(low, kThreshold);
    EXPECT_GT(high, kSpringing - 0.12);
  }
}

}  // namespace
}  // namespace cgs::arch_test
