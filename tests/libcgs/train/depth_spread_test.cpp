// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"
#include "tests/support/ray_of_splats.h"

namespace cgs::depth_spread_test {
namespace {

using test::doubled;

struct Drawn {
  TrainingBuffers rendered;
  DepthMap measured, sigma;
};

// Sums of three contributors at about the measured depth, which one pixel in five lacks.
Drawn drawn(int width, int height, unsigned seed) {
  Drawn out;
  out.measured = test::noise_raster(width, height, seed, 0.8f, 1.2f);
  out.sigma = test::noise_raster(width, height, seed + 1, 0.05f, 0.1f);
  TrainingBuffers& r = out.rendered;
  r.alpha = r.depth_sum = r.depth_square_sum = Raster<float>(width, height, 0);
  for (unsigned k = 0; k < 3; ++k) {
    const Raster<float> w = test::noise_raster(width, height, seed + 2 + k, 0, 0.3f);
    const Raster<float> z = test::noise_raster(width, height, seed + 5 + k, 0.7f, 1.3f);
    for (size_t i = 0; i < w.data.size(); ++i) {
      r.alpha.data[i] += w.data[i];
      r.depth_sum.data[i] += w.data[i] * z.data[i];
      r.depth_square_sum.data[i] += w.data[i] * z.data[i] * z.data[i];
    }
  }
  for (size_t i = 0; i < out.measured.data.size(); i += 5) out.measured.data[i] = std::nanf("");
  return out;
}

// In the words of the header.
double reference(const Drawn& d,
                 const Raster<double>& alpha,
                 const Raster<double>& depth,
                 const Raster<double>& square) {
  double sum = 0;
  for (size_t i = 0; i < alpha.data.size(); ++i) {
    const auto z = double(d.measured.data[i]);
    if (std::isnan(z)) continue;
    const double apart = square.data[i] - 2 * z * depth.data[i] + z * z * alpha.data[i];
    sum += std::sqrt(2 + apart / std::pow(double(d.sigma.data[i]), 2) - alpha.data[i]) - 1;
  }
  return sum / double(alpha.data.size());
}

TEST(DepthSpread, EqualsItsDefinitionAndHasItsDerivatives) {
  const Drawn d = drawn(17, 13, 3);
  const Raster<double> alpha = doubled(d.rendered.alpha);
  const Raster<double> depth = doubled(d.rendered.depth_sum);
  const Raster<double> square = doubled(d.rendered.depth_square_sum);
  TrainingBuffers gradient;
  const double value = depth_spread(d.rendered, d.measured, d.sigma, 3, gradient);
  EXPECT_NEAR(value, 3 * reference(d, alpha, depth, square), 1e-6);
  test::expect_gradient(gradient.alpha, alpha, [&](const Raster<double>& moved) {
    return 3 * reference(d, moved, depth, square);
  });
  test::expect_gradient(gradient.depth_sum, depth, [&](const Raster<double>& moved) {
    return 3 * reference(d, alpha, moved, square);
  });
  test::expect_gradient(gradient.depth_square_sum, square, [&](const Raster<double>& moved) {
    return 3 * reference(d, alpha, depth, moved);
  });
  EXPECT_TRUE(gradient.color[0].empty());
}

TEST(DepthSpread, OfWeightZeroTouchesNothing) {
  const Drawn d = drawn(5, 4, 1);
  TrainingBuffers gradient;
  EXPECT_EQ(depth_spread(d.rendered, d.measured, d.sigma, 0, gradient), 0);
  EXPECT_TRUE(gradient.alpha.empty() && gradient.depth_square_sum.empty());
}

TEST(DepthSpread, IsTheSameForAnyNumberOfThreads) {
  const Drawn d = drawn(61, 97, 1);
  TrainingBuffers expected;
  const double value = depth_spread(d.rendered, d.measured, d.sigma, 1, expected);
  test::for_thread_counts([&] {
    TrainingBuffers gradient;
    EXPECT_EQ(depth_spread(d.rendered, d.measured, d.sigma, 1, gradient), value);
    EXPECT_EQ(gradient.depth_sum.data, expected.depth_sum.data);
  });
}

TEST(DepthSpread, RefusesUnequalSizes) {
  Drawn d = drawn(5, 4, 1);
  TrainingBuffers gradient;
  d.measured = DepthMap(4, 5, 1);
  EXPECT_THROW(depth_spread(d.rendered, d.measured, d.sigma, 1, gradient), InvalidInput);
}

// Half of the light comes from a splat before the wall, of the colour of the wall: no photograph
// tells.
TEST(DepthSpread, TakesAwayWhatFloatsBeforeTheMeasuredDepth) {
  Gaussians ray = test::ray_of_splats({0.7f, 1.0f}, {0.5f, 0.9f});
  const Camera camera = test::camera_of_ray();
  const DepthMap measured(camera.width, camera.height, 1.0f);
  const DepthMap sigma(camera.width, camera.height, 0.01f);
  test::descend_on_opacities(ray, {}, [&](const TrainingBuffers& drawn, TrainingBuffers& loss) {
    depth_spread(drawn, measured, sigma, 1, loss);
  });
  EXPECT_LT(ray.opacity[0], 0.05f);
  EXPECT_GT(ray.opacity[1], 0.85f);
}

}  // namespace
}  // namespace cgs::depth_spread_test
