// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/pictures.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

namespace cgs::pictures_test {
namespace {

TEST(DepthPicture, IsRedNearBlueFarAndBlackWhereUnknown) {
  DepthMap depth(200, 1, 0.0f);
  for (int x = 0; x < 200; ++x) depth(x, 0) = 1.0f + 0.05f * static_cast<float>(x);
  depth(100, 0) = std::numeric_limits<float>::quiet_NaN();
  const ColorImage picture = depth_picture(depth);
  EXPECT_GT(picture(0, 0).x(), 2 * picture(0, 0).z());
  EXPECT_GT(picture(199, 0).z(), picture(199, 0).y());
  EXPECT_EQ(picture(100, 0), Eigen::Vector3f::Zero());
}

TEST(DepthPicture, OfNothingKnownIsBlack) {
  const DepthMap depth(3, 2, std::numeric_limits<float>::quiet_NaN());
  for (const auto& c : depth_picture(depth).data) EXPECT_EQ(c, Eigen::Vector3f::Zero());
}

TEST(ContactSheet, HoldsUprightPicturesBesideWideOnes) {
  const ColorImage wide(8, 4, Eigen::Vector3f(1, 0, 0));
  const ColorImage tall(4, 8, Eigen::Vector3f(0, 0, 1));
  const ColorImage sheet = contact_sheet({wide, tall, wide}, 2);
  EXPECT_EQ(sheet.width, 8 + 4 + 8);
  EXPECT_EQ(sheet.height, 8 + 4 + 8);
  const auto count = [&](const Eigen::Vector3f& color) {
    return std::count(sheet.data.begin(), sheet.data.end(), color);
  };
  EXPECT_EQ(count({1, 0, 0}), 2 * 32);
  EXPECT_EQ(count({0, 0, 1}), 32);
}

TEST(NormalPicture, ASurfaceFacingTheCameraIsTheUsualBlue) {
  const NormalMap normals(1, 1, Eigen::Vector3f(0, 0, -1));  // camera looks along +z
  const ColorImage picture = normal_picture(normals, Eigen::Isometry3d::Identity());
  EXPECT_LT((picture(0, 0) - Eigen::Vector3f(0.5f, 0.5f, 1.0f)).norm(), 1e-6f);
}

}  // namespace
}  // namespace cgs::pictures_test
