// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_view.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/loss_checks.h"

namespace cgs::training_view_test {
namespace {

double product(const Raster<float>& a, const Raster<float>& b) {
  EXPECT_EQ(a.data.size(), b.data.size());
  double out = 0;
  for (size_t i = 0; i < a.data.size(); ++i) out += double(a.data[i]) * double(b.data[i]);
  return out;
}

// What spread() is for: derivatives by the fine picture, from those by its means.
TEST(Spread, IsTheTransposeOfHalved) {
  for (const auto& [width, height] : {std::pair(8, 6), {2, 2}, {10, 4}}) {
    const Raster<float> fine = test::noise_raster(width, height, 1, -1, 1);
    const Raster<float> slope = test::noise_raster(width / 2, height / 2, 2, -1, 1);
    const Raster<float> spread_out = spread(slope);
    EXPECT_EQ(spread_out.width, width);
    EXPECT_EQ(spread_out.height, height);
    EXPECT_NEAR(product(halved(fine), slope), product(fine, spread_out), 1e-5);
  }
  EXPECT_TRUE(spread(Raster<float>()).empty());
}

// An odd last row or column is left out, so that there nothing is known.
TEST(Spread, IsTheTransposeOfHalvedButForOddRowsAndColumns) {
  const Raster<float> fine = test::noise_raster(7, 5, 3, -1, 1);
  const Raster<float> slope = test::noise_raster(3, 2, 4, -1, 1);
  const Raster<float> spread_out = spread(slope);
  ASSERT_EQ(spread_out.width, 6);
  ASSERT_EQ(spread_out.height, 4);
  Raster<float> whole(7, 5, 0);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 6; ++x) whole(x, y) = spread_out(x, y);
  }
  EXPECT_NEAR(product(halved(fine), slope), product(fine, whole), 1e-5);
}

TrainingView odd_view() {
  TrainingView out;
  out.camera = {.width = 7, .height = 5, .fx = 9, .fy = 8, .cx = 3.4, .cy = 2.6};
  out.photograph = test::noise_planes(7, 5, 5);
  out.use = MaskMap(7, 5, 1);
  out.layer = Raster<uint8_t>(7, 5, 0);
  out.measured = DepthMap(7, 5, std::nanf(""));
  out.sigma = DepthMap(7, 5, std::nanf(""));
  return out;
}

TEST(HalvedView, ShowsEachPlaceAtHalfItsCoordinates) {
  const TrainingView view = odd_view();
  const TrainingView out = halved(view);
  EXPECT_EQ(out.camera.width, 3);
  EXPECT_EQ(out.camera.height, 2);
  const Eigen::Vector3d place(0.2, -0.1, 2);
  const Eigen::Vector3d before = view.camera.project(place);
  const Eigen::Vector3d after = out.camera.project(place);
  EXPECT_NEAR(after.x(), before.x() / 2, 1e-12);
  EXPECT_NEAR(after.y(), before.y() / 2, 1e-12);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(out.photograph.at(c).data, halved(view.photograph.at(c)).data);
  }
  for (const Raster<float>* raster : {&out.photograph[0], &out.measured, &out.sigma}) {
    EXPECT_EQ(raster->width, 3);
    EXPECT_EQ(raster->height, 2);
  }
}

TEST(HalvedView, UsesAPixelOnlyIfAllFourMayBeUsed) {
  TrainingView view = odd_view();
  view.use(3, 1) = 0;
  view.use(6, 4) = 0;  // in a column and row that are left out
  const TrainingView out = halved(view);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) EXPECT_EQ(out.use(x, y), x == 1 && y == 0 ? 0 : 1);
  }
  view.use = {};
  EXPECT_TRUE(halved(view).use.empty());
}

TEST(HalvedView, TakesDepthAndLayerOfOnePixelEach) {
  TrainingView view = odd_view();
  view.measured(2, 2) = 1.5f;
  view.measured(3, 2) = 7;
  view.sigma(2, 2) = 0.1f;
  view.layer(4, 0) = 3;
  const TrainingView out = halved(view);
  EXPECT_EQ(out.measured(1, 1), 1.5f);
  EXPECT_EQ(out.sigma(1, 1), 0.1f);
  EXPECT_TRUE(std::isnan(out.measured(0, 0)));
  EXPECT_EQ(out.layer(2, 0), 3);
}

TEST(TrainingViewOf, KnowsDepthWhereItIsMeasuredAlone) {
  View view;
  view.camera = {.width = 3, .height = 1, .fx = 3, .fy = 3, .cx = 1.5, .cy = 0.5};
  view.image = ColorImage(3, 1, Eigen::Vector3f(0.2f, 0.4f, 0.6f));
  ViewPriors priors;
  priors.depth = DepthMap(3, 1, 2);
  priors.sigma = DepthMap(3, 1, 0.1f);
  priors.layer = Raster<uint8_t>(3, 1, 0);
  priors.origin = Raster<DepthOrigin>(3, 1, DepthOrigin::Completed);
  priors.origin(1, 0) = DepthOrigin::Measured;
  const TrainingView out = training_view(view, priors);
  EXPECT_TRUE(std::isnan(out.measured(0, 0)));
  EXPECT_EQ(out.measured(1, 0), 2);
  EXPECT_FALSE(out.is_grey);
  EXPECT_EQ(out.photograph[2](0, 0), 0.6f);
  view.response.is_grey = true;
  const TrainingView grey = training_view(view, priors);
  EXPECT_TRUE(grey.is_grey);
  EXPECT_EQ(grey.photograph[0].data, grey.photograph[2].data);
  EXPECT_GT(grey.photograph[0](0, 0), 0.2f);
  EXPECT_LT(grey.photograph[0](0, 0), 0.6f);
}

}  // namespace
}  // namespace cgs::training_view_test
