// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/reduced_view.h"

#include <gtest/gtest.h>

#include "tests/support/stereo_scene.h"

namespace cgs::reduced_view_test {
namespace {

TEST(ReducedView, AveragesPixelsAndKeepsTheRays) {
  View view;
  view.camera = test::looking_at({0, 0, 0}, {0, 0, 1}, 7, 5, 9);
  view.image = ColorImage(7, 5, Eigen::Vector3f::Zero());
  view.valid = MaskMap(7, 5, 1);
  view.image(2, 0) = Eigen::Vector3f(0.4f, 0.8f, 0);
  view.image(3, 1) = Eigen::Vector3f(0.4f, 0, 0);
  view.valid(5, 3) = 0;
  const View half = reduced_view(view, 2);
  ASSERT_EQ(half.camera.width, 3);
  ASSERT_EQ(half.camera.height, 2);
  EXPECT_LT((half.image(1, 0) - Eigen::Vector3f(0.2f, 0.2f, 0)).norm(), 1e-6f);
  EXPECT_EQ(half.valid(2, 1), 0);
  EXPECT_EQ(half.valid(1, 1), 1);
  EXPECT_EQ(half.camera.ray_in_cam(1, 1), view.camera.ray_in_cam(2, 2));
}

TEST(ReductionTo, IsTheNearestWholeOne) {
  EXPECT_EQ(reduction_to(256, 100), 1);
  EXPECT_EQ(reduction_to(256, 383), 1);
  EXPECT_EQ(reduction_to(256, 384), 2);
  EXPECT_EQ(reduction_to(256, 1002), 4);
}

}  // namespace
}  // namespace cgs::reduced_view_test
