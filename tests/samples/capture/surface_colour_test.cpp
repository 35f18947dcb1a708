// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/surface_colour.h"

#include <gtest/gtest.h>

namespace cgs::surface_colour_test {
namespace {

PatternPoint wall_point(int i, Material material) {
  return {
      .position = {0.0137F * static_cast<float>(i % 300), 0, 0.0193F * static_cast<float>(i / 300)},
      .normal = {0, -1, 0},
      .material = material,
      .part = 3,
      .footprint = 0.007F};
}

TEST(Albedo, IsAReflectanceAndVariesInEveryMaterial) {
  for (const auto material : {Material::Ashlar,
                              Material::Arch,
                              Material::Carved,
                              Material::Paving,
                              Material::Wood,
                              Material::Iron,
                              Material::Painted}) {
    float sum = 0;
    float squares = 0;
    constexpr int kCount = 60000;
    for (int i = 0; i < kCount; ++i) {
      const Eigen::Vector3f color = albedo(wall_point(i, material));
      ASSERT_GT(color.minCoeff(), 0);
      ASSERT_LT(color.maxCoeff(), 1);
      sum += color.mean() / kCount;
      squares += color.mean() * color.mean() / kCount;
    }
    EXPECT_GT(std::sqrt(squares - sum * sum), 0.2F * sum) << static_cast<int>(material);
  }
}

TEST(Albedo, LosesOnlyDetailWithAWiderFootprint) {
  double fine = 0;
  double coarse = 0;
  for (int i = 0; i < 60000; ++i) {
    PatternPoint point = wall_point(i, Material::Ashlar);
    const auto near = static_cast<double>(albedo(point).mean());
    point.footprint = 0.02F;
    const auto far = static_cast<double>(albedo(point).mean());
    fine += near;
    coarse += far;
  }
  EXPECT_NEAR(coarse / fine, 1, 0.1);
}

}  // namespace
}  // namespace cgs::surface_colour_test
