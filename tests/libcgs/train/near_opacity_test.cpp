// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"
#include "tests/support/ray_of_splats.h"

namespace cgs::near_opacity_test {
namespace {

// Along the ray, one beside the picture, one behind the camera.
Gaussians splats() {
  Gaussians out = test::ray_of_splats({0.2f, 0.49f, 0.51f, 1, 0.3f, -0.2f},
                                      {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f});
  out.position[4].x() = 1;
  return out;
}

TEST(NearOpacity, EqualsItsDefinitionAndHasItsDerivatives) {
  Gaussians g = splats();
  const auto value = [&] {
    std::vector<float> ignored;
    return near_opacity(g, g.size(), {test::camera_of_ray(), 0.5}, 3, ignored);
  };
  EXPECT_NEAR(value(), 3 * (0.1 + 0.2) / 6, 1e-7);
  std::vector<float> gradient;
  near_opacity(g, g.size(), {test::camera_of_ray(), 0.5}, 3, gradient);
  ASSERT_EQ(gradient.size(), g.size());
  for (size_t i = 0; i < g.size(); ++i) {
    const float at = g.opacity[i];
    g.opacity[i] = at + 0.0625f;
    const double above = value();
    g.opacity[i] = at - 0.0625f;
    EXPECT_NEAR(double(gradient[i]), (above - value()) / 0.125, 1e-6) << i;
    g.opacity[i] = at;
  }
}

TEST(NearOpacity, LeavesOutThoseBehindTheCount) {
  std::vector<float> gradient;
  const double value = near_opacity(splats(), 1, {test::camera_of_ray(), 0.5}, 3, gradient);
  EXPECT_NEAR(value, 3 * 0.1, 1e-7);
  EXPECT_EQ(gradient, std::vector<float>({3, 0, 0, 0, 0, 0}));
  EXPECT_THROW(near_opacity(splats(), 7, {test::camera_of_ray(), 0.5}, 3, gradient), InvalidInput);
}

TEST(NearOpacity, OfWeightZeroTouchesNothing) {
  std::vector<float> gradient;
  EXPECT_EQ(near_opacity(splats(), 6, {test::camera_of_ray(), 0.5}, 0, gradient), 0);
  EXPECT_TRUE(gradient.empty());
}

TEST(NearOpacity, RefusesADistanceThatIsNoneAndGradientsOfOthers) {
  std::vector<float> gradient;
  EXPECT_THROW(near_opacity(splats(), 6, {test::camera_of_ray(), NAN}, 1, gradient), InvalidInput);
  gradient.resize(2);
  EXPECT_THROW(near_opacity(splats(), 6, {test::camera_of_ray(), 1}, 1, gradient), InvalidInput);
}

// A floater before the lens that makes the picture right stays for the picture; the term removes
// it and leaves the wall.
TEST(NearOpacity, RemovesWhatFloatsBeforeTheLens) {
  Gaussians g = test::ray_of_splats({0.1f, 1.0f}, {0.9f, 0.9f});
  for (int step = 0; step < 100; ++step) {
    std::vector<float> gradient;
    near_opacity(g, g.size(), {test::camera_of_ray(), 0.8}, 1, gradient);
    for (size_t i = 0; i < g.size(); ++i) {
      const float logit = std::log(g.opacity[i] / (1 - g.opacity[i]));
      g.opacity[i] = 1 / (1 + std::exp(-logit + (gradient[i] > 0 ? 0.1f : 0.0f)));
    }
  }
  EXPECT_LT(g.opacity[0], 1e-3f);
  EXPECT_NEAR(g.opacity[1], 0.9f, 1e-4f);
}

TEST(NearOpacity, IsTheSameForAnyNumberOfThreads) {
  const Raster<float> z = test::noise_raster(20000, 1, 1, 0.1f, 1);
  const Raster<float> o = test::noise_raster(20000, 1, 2, 0, 1);
  const Gaussians g = test::ray_of_splats(z.data, o.data);
  std::vector<float> first;
  const double expected = near_opacity(g, g.size(), {test::camera_of_ray(), 0.5}, 1, first);
  test::for_thread_counts([&] {
    std::vector<float> gradient;
    EXPECT_EQ(near_opacity(g, g.size(), {test::camera_of_ray(), 0.5}, 1, gradient), expected);
    EXPECT_EQ(gradient, first);
  });
}

}  // namespace
}  // namespace cgs::near_opacity_test
