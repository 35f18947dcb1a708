// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/corrupted_depth.h"
#include "tests/support/loss_checks.h"
#include "tests/support/planted_training.h"

namespace cgs::depth_order_test {
namespace {

// Every third pixel is measured.
DepthMap some_of(const DepthMap& truth) {
  DepthMap out(truth.width, truth.height, std::nanf(""));
  for (size_t i = 0; i < truth.data.size(); i += 3) out.data[i] = truth.data[i];
  return out;
}

TEST(DepthOrder, HasTheDerivativesOfItsDefinition) {
  const DepthMap depth = test::noise_raster(11, 9, 1, 0.5f, 1.5f);
  std::vector<DepthOrder> order;
  for (uint32_t i = 0; i + 20 < 99; ++i) order.push_back({i, (7 * i + 13) % 99});
  const Raster<double> at = test::doubled(depth);
  const auto reference = [&](const Raster<double>& z) {
    double sum = 0;
    for (const auto& [near, far] : order) {
      if (near == far) continue;
      sum += std::max(0.0, std::log(z.data[near] / z.data[far]) + 1e-4);
    }
    return 5 * sum / double(order.size());
  };
  std::erase_if(order, [](const DepthOrder& pair) { return pair.nearer == pair.farther; });
  Raster<float> gradient;
  EXPECT_NEAR(depth_order(depth, order, 5, gradient), reference(at), 1e-6);
  test::expect_gradient(gradient, at, reference);
}

TEST(DepthOrder, OfWeightZeroTouchesNothing) {
  const std::vector<DepthOrder> order = {{0, 1}};
  Raster<float> gradient;
  EXPECT_EQ(depth_order(DepthMap(2, 1, 1.0f), order, 0, gradient), 0);
  EXPECT_TRUE(gradient.empty());
}

// Scale, offset, bumps and whether it is depth or disparity: the order stands all of it.
TEST(DepthOrders, AreTrueOfCorruptedDepth) {
  const test::PlantedScene planted = test::planted_scene(0);
  for (const bool disparity : {false, true}) {
    for (unsigned view = 0; view < 3; ++view) {
      const DepthMap& truth = planted.truth[view];
      const DepthMap given = test::corrupted_depth(truth, view, {.disparity = disparity});
      const DepthOrders found = depth_orders(given, some_of(truth));
      EXPECT_EQ(found.is_disparity, disparity);
      ASSERT_GT(found.pairs.size(), 100u);
      size_t wrong = 0;
      for (const auto& [near, far] : found.pairs) {
        wrong += truth.data[near] > 1.01f * truth.data[far];
      }
      // Bumps of a fifth turn pairs round that differ by less.
      EXPECT_LT(double(wrong), 0.1 * double(found.pairs.size())) << view;
    }
  }
}

// Where the order is wrong and some of it is measured, it is not believed.
TEST(DepthOrders, AreNotTakenFromARegionThatMeasurementContradicts) {
  const test::PlantedScene planted = test::planted_scene(0);
  const DepthMap& truth = planted.truth[1];
  const test::Corruption inverted{.bumps = 0, .inverted_x = 32, .inverted_y = 0};
  const DepthMap given = test::corrupted_depth(truth, 1, inverted);
  const auto count_wrong = [&](const DepthMap& measured) {
    size_t wrong = 0;
    for (const auto& [near, far] : depth_orders(given, measured).pairs) {
      wrong += truth.data[near] > 1.01f * truth.data[far];
    }
    return wrong;
  };
  // Measured only outside of that patch: nothing tells.
  DepthMap blind = some_of(truth);
  for (int y = 0; y < 32; ++y) {
    for (int x = 32; x < 64; ++x) blind(x, y) = std::nanf("");
  }
  EXPECT_GT(count_wrong(blind), 20u);
  EXPECT_LT(count_wrong(some_of(truth)), count_wrong(blind) / 10);
}

// Depth of pixels that are not measured, wrong by up to a third, comes into order.
TEST(DepthOrder, BringsUnmeasuredDepthIntoOrder) {
  const test::PlantedScene planted = test::planted_scene(0);
  const DepthMap& truth = planted.truth[1];
  const DepthMap measured = some_of(truth);
  const DepthOrders found = depth_orders(test::corrupted_depth(truth, 1, {}), measured);
  DepthMap depth = truth;
  const Raster<float> noise = test::noise_raster(truth.width, truth.height, 3, 0.7f, 1.3f);
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (std::isnan(measured.data[i])) depth.data[i] *= noise.data[i];
  }
  Raster<float> gradient;
  const double before = depth_order(depth, found.pairs, 1, gradient);
  for (int step = 0; step < 200; ++step) {
    gradient = {};
    depth_order(depth, found.pairs, 1, gradient);
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (std::isnan(measured.data[i])) depth.data[i] -= 5 * gradient.data[i];
    }
  }
  gradient = {};
  EXPECT_LT(depth_order(depth, found.pairs, 1, gradient), 0.1 * before);
}

TEST(DepthOrders, RefuseUnequalSizes) {
  EXPECT_THROW(depth_orders(DepthMap(4, 5, 1.0f), DepthMap(5, 4, 1.0f)), InvalidInput);
}

TEST(DepthOrders, AreNoneOfDepthThatIsNotThere) {
  const DepthMap none(40, 40, std::nanf(""));
  EXPECT_TRUE(depth_orders(none, none).pairs.empty());
}

}  // namespace
}  // namespace cgs::depth_order_test
