// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"
#include "tests/support/ray_of_splats.h"

namespace cgs::emptiness_test {
namespace {

TrainingBuffers drawn(int width, int height, unsigned seed) {
  TrainingBuffers out;
  out.alpha = test::noise_raster(width, height, seed, 0, 1);
  out.weight_square_sum = test::noise_raster(width, height, seed + 1, 0, 1);
  return out;
}

double reference(const Raster<double>& alpha, const Raster<double>& squares) {
  double sum = 0;
  for (size_t i = 0; i < alpha.data.size(); ++i) sum += alpha.data[i] - squares.data[i];
  return sum / double(alpha.data.size());
}

TEST(Emptiness, EqualsItsDefinitionAndHasItsDerivatives) {
  const TrainingBuffers rendered = drawn(17, 13, 3);
  const Raster<double> alpha = test::doubled(rendered.alpha);
  const Raster<double> squares = test::doubled(rendered.weight_square_sum);
  TrainingBuffers gradient;
  EXPECT_NEAR(emptiness(rendered, 5, gradient), 5 * reference(alpha, squares), 1e-9);
  test::expect_gradient(gradient.alpha, alpha, [&](const Raster<double>& moved) {
    return 5 * reference(moved, squares);
  });
  test::expect_gradient(gradient.weight_square_sum, squares, [&](const Raster<double>& moved) {
    return 5 * reference(alpha, moved);
  });
}

TEST(Emptiness, OfWeightZeroTouchesNothing) {
  TrainingBuffers gradient;
  EXPECT_EQ(emptiness(drawn(5, 4, 1), 0, gradient), 0);
  EXPECT_TRUE(gradient.alpha.empty() && gradient.weight_square_sum.empty());
}

TEST(Emptiness, IsTheSameForAnyNumberOfThreads) {
  const TrainingBuffers rendered = drawn(61, 97, 1);
  TrainingBuffers first;
  const double expected = emptiness(rendered, 1, first);
  test::for_thread_counts([&] {
    TrainingBuffers gradient;
    EXPECT_EQ(emptiness(rendered, 1, gradient), expected);
  });
}

TEST(Emptiness, RefusesAPictureWithoutSquaredWeights) {
  TrainingBuffers rendered = drawn(5, 4, 1);
  rendered.weight_square_sum = {};
  TrainingBuffers gradient;
  EXPECT_THROW(emptiness(rendered, 1, gradient), InvalidInput);
}

// Three half transparent splats of one colour look as one that is not.
TEST(Emptiness, LeavesOneSplatOfSeveralOnARay) {
  Gaussians ray = test::ray_of_splats({0.8f, 1.0f, 1.2f}, {0.55f, 0.4f, 0.45f});
  const auto strongest_share = [&] {
    TrainingRasterizer rasterizer({.weight_squares = true});
    const TrainingBuffers& seen = rasterizer.forward(ray, test::camera_of_ray());
    return seen.weight_square_sum(1, 1) / (seen.alpha(1, 1) * seen.alpha(1, 1));
  };
  EXPECT_LT(strongest_share(), 0.6f);
  test::descend_on_opacities(
      ray, {.weight_squares = true}, [&](const TrainingBuffers& seen, TrainingBuffers& loss) {
        emptiness(seen, 1, loss);
      });
  EXPECT_GT(strongest_share(), 0.95f);
  EXPECT_GT(ray.opacity[0], 0.95f);
}

}  // namespace
}  // namespace cgs::emptiness_test
