// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/rasterizer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "tests/support/oblique_camera.h"
#include "tests/support/reference_rasterizer.h"

namespace cgs::rasterizer_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A larger one.
Camera oblique_camera() {
  Camera camera = test::oblique_camera();
  camera.width = 53;
  camera.height = 38;
  camera.fx = 61;
  camera.fy = 57;
  camera.cx = 24.3;
  camera.cy = 20.1;
  return camera;
}

// Random Gaussians over the image and well beyond it, between depths 0.4 and 1.2.
struct Spread {
  int count = 300;
  float sigma_px = 2;    // of the longest axis
  float anisotropy = 1;  // longest axis over the two others
  float min_opacity = 0.05f;
  float max_opacity = 0.95f;
  int sh_degree = 0;
};

Gaussians random_gaussians(const Camera& camera, const Spread& spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<float> normal;
  Gaussians g;
  g.sh_degree = spread.sh_degree;
  for (int i = 0; i < spread.count; ++i) {
    const double z = 0.4 + 0.8 * uniform(random);
    const double u = camera.width * (1.8 * uniform(random) - 0.4);
    const double v = camera.height * (1.8 * uniform(random) - 0.4);
    g.position.push_back(camera.unproject(u, v, z).cast<float>());
    const float longest = spread.sigma_px * float(z / camera.fx) * float(0.5 + uniform(random));
    g.scale.emplace_back(longest / spread.anisotropy, longest, longest / spread.anisotropy);
    g.rotation.emplace_back(normal(random), normal(random), normal(random), normal(random));
    g.opacity.push_back(spread.min_opacity +
                        (spread.max_opacity - spread.min_opacity) * float(uniform(random)));
    for (int k = 0; k < g.sh_count(); ++k) {
      g.sh.emplace_back(normal(random), normal(random), normal(random));
    }
  }
  return g;
}

// Compares everything a view holds with the reference; `tolerance` is that of colour and alpha.
void expect_reference(const Gaussians& g, const Camera& camera, double tolerance, double slack) {
  const Eigen::Vector3f background(0.2f, 0.4f, 0.8f);
  RasterizerOptions options;
  options.background = background;
  const RenderBuffers got = rasterize(g, camera, options);
  const test::ReferenceImage truth =
      test::rasterize_reference(g, camera, background.cast<double>(), slack);
  size_t unclear = 0;
  for (size_t p = 0; p < got.alpha.data.size(); ++p) {
    // Colours of these scenes reach about 2; an undecided weight moves everything behind it too.
    const double room = tolerance + 2 * truth.undecided.data[p];
    unclear += truth.undecided.data[p] > 0 ? 1 : 0;
    ASSERT_NEAR(double(got.alpha.data[p]), truth.alpha.data[p], room) << p;
    ASSERT_LT((got.color.data[p].cast<double>() - truth.color.data[p]).cwiseAbs().maxCoeff(),
              4 * room)
        << p;
    ASSERT_NEAR(double(got.weight_squared.data[p]), truth.weight_squared.data[p], 2 * room) << p;
    if (truth.alpha.data[p] > 0.5 + room) {
      ASSERT_NEAR(double(got.depth.data[p]), truth.depth.data[p], 4 * room) << p;
      ASSERT_NEAR(double(got.depth_variance.data[p]), truth.depth_variance.data[p], 4 * room) << p;
    }
    if (truth.alpha.data[p] < 0.5 - room) {
      ASSERT_TRUE(std::isnan(got.depth.data[p])) << p;
      ASSERT_EQ(got.depth_variance.data[p], 0) << p;
    }
    if (truth.close_call.data[p] != 0 || truth.undecided.data[p] > 0) continue;
    ASSERT_EQ(got.strongest.data[p], truth.strongest.data[p]) << p;
    ASSERT_EQ(std::isnan(got.median_depth.data[p]), std::isnan(truth.median_depth.data[p])) << p;
    if (!std::isnan(truth.median_depth.data[p])) {
      ASSERT_FLOAT_EQ(got.median_depth.data[p], float(truth.median_depth.data[p])) << p;
    }
  }
  EXPECT_LT(unclear, got.alpha.data.size() / 2);  // or the comparison says little
}

template <typename T>
bool same_bits(const Raster<T>& a, const Raster<T>& b) {
  return a.data.size() == b.data.size() &&
         std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(T)) == 0;
}

bool same_bits(const RenderBuffers& a, const RenderBuffers& b) {
  return same_bits(a.color, b.color) && same_bits(a.alpha, b.alpha) &&
         same_bits(a.depth, b.depth) && same_bits(a.median_depth, b.median_depth) &&
         same_bits(a.depth_variance, b.depth_variance) &&
         same_bits(a.weight_squared, b.weight_squared) && same_bits(a.strongest, b.strongest);
}

TEST(RasterizerOptions, AreValidByDefaultAndRefuseEachFieldOutOfRange) {
  EXPECT_NO_THROW(RasterizerOptions{}.validate());
  EXPECT_EQ(RasterizerOptions{}.background, Eigen::Vector3f::Zero());
  EXPECT_THROW((RasterizerOptions{.background = {0, kNan, 0}}.validate()), InvalidInput);
  EXPECT_THROW((RasterizerOptions{.min_alpha = 0}.validate()), InvalidInput);
  EXPECT_THROW((RasterizerOptions{.min_alpha = 1.5f}.validate()), InvalidInput);
  EXPECT_THROW((RasterizerOptions{.dilation = -1}.validate()), InvalidInput);
  EXPECT_THROW((RasterizerOptions{.near_depth = kNan}.validate()), InvalidInput);
}

TEST(Rasterize, EqualsTheReferenceForBalls) {
  const Camera camera = oblique_camera();
  for (const float sigma_px : {0.3f, 1.0f, 3.0f, 10.0f}) {
    expect_reference(random_gaussians(camera, {.sigma_px = sigma_px}, 1), camera, 2e-6, 1e-4);
  }
}

TEST(Rasterize, EqualsTheReferenceForEllipsoidsWithDirectionalColour) {
  const Camera camera = oblique_camera();
  const Spread spread{.sigma_px = 4, .anisotropy = 5, .sh_degree = 1};
  expect_reference(random_gaussians(camera, spread, 2), camera, 3e-6, 1e-4);
}

TEST(Rasterize, EqualsTheReferenceForNeedlesUpToTenThousandPixels) {
  const Camera camera = oblique_camera();
  for (const float sigma_px : {1.0f, 1e2f, 1e4f}) {
    for (const float anisotropy : {1.0f, 1e2f, 1e4f, 1e6f}) {
      SCOPED_TRACE(testing::Message() << sigma_px << " px, 1 : " << anisotropy);
      const Spread spread{.count = 60,
                          .sigma_px = sigma_px,
                          .anisotropy = anisotropy,
                          .min_opacity = 0.02f,
                          .max_opacity = 0.2f};
      expect_reference(random_gaussians(camera, spread, 3), camera, 1e-5, 1e-3);
      // One at a time at full opacity: nothing of its error is hidden by what lies before it.
      for (unsigned seed = 100; seed < 120; ++seed) {
        const Spread alone{.count = 1,
                           .sigma_px = sigma_px,
                           .anisotropy = anisotropy,
                           .min_opacity = 0.99f,
                           .max_opacity = 0.99f};
        const double tolerance = sigma_px > 100 ? 2e-3 : 3e-5;
        expect_reference(random_gaussians(camera, alone, seed), camera, tolerance, 1e-3);
      }
    }
  }
}

TEST(Rasterize, EqualsTheReferenceForSaturatedOpacities) {
  const Camera camera = oblique_camera();
  Gaussians g = random_gaussians(camera, {.count = 200, .sigma_px = 3}, 4);
  for (size_t i = 0; i < g.size(); ++i) {
    const std::array<float, 5> extremes = {1.0f, 0.999999f, 1e-30f, 1 / 254.0f, 0.5f};
    g.opacity[i] = extremes[i % extremes.size()];
  }
  expect_reference(g, camera, 5e-6, 1e-4);
}

TEST(Rasterize, WeightsAndTransmittanceSumToOneOverManyCoplanarSplats) {
  Camera camera{.width = 4, .height = 4, .fx = 4, .fy = 4, .cx = 2, .cy = 2};
  constexpr size_t kCount = 100'000;
  for (const float opacity : {0.004f, 0.0041f, 0.1f, 1.0f}) {
    Gaussians g;
    g.position.assign(kCount, {0, 0, 0.5f});
    g.scale.assign(kCount, Eigen::Vector3f::Constant(10));
    g.rotation.assign(kCount, {1, 0, 0, 0});
    g.opacity.assign(kCount, opacity);
    g.sh.assign(kCount, Eigen::Vector3f::Constant(0.5f / kShC0));  // white: colour = sum of weights
    const RenderBuffers view = rasterize(g, camera);
    for (size_t p = 0; p < view.alpha.data.size(); ++p) {
      EXPECT_GT(view.alpha.data[p], 0.9998f);
      EXPECT_LE(view.alpha.data[p], 1.0f);
      EXPECT_NEAR(view.color.data[p].x(), view.alpha.data[p], 1e-5);
      EXPECT_EQ(view.depth.data[p], 0.5f);
      EXPECT_EQ(view.depth_variance.data[p], 0);
      EXPECT_EQ(view.median_depth.data[p], 0.5f);
      EXPECT_EQ(view.strongest.data[p], 0U);
    }
  }
}

TEST(Rasterize, KeepsTheDigitsOfTheDepthVariance) {
  // Two surfaces 1e-4 apart at depth 1: the variance 2e-9 is far below the float step of depth^2.
  Camera camera{.width = 20, .height = 20, .fx = 20, .fy = 20, .cx = 10, .cy = 10};
  Gaussians g;
  const float near = 1;
  const float far = 1 + 0x1p-13f;
  for (const float z : {near, far}) {
    g.position.emplace_back(0, 0, z);
    g.scale.push_back(Eigen::Vector3f::Constant(100));
    g.rotation.emplace_back(1, 0, 0, 0);
    g.opacity.push_back(0.75f);
    g.sh.emplace_back(0, 0, 0);
  }
  const RenderBuffers view = rasterize(g, camera);
  const double share = 0.25 * 0.75 / (0.75 + 0.25 * 0.75);
  const double expected = share * (1 - share) * std::pow(0x1p-13, 2);
  EXPECT_NEAR(double(view.depth_variance(10, 10)), expected, 1e-4 * expected);
}

TEST(Rasterize, GivesTheSameBitsForAnyNumberOfThreads) {
  Camera camera = oblique_camera();
  camera = resized(camera, 530, 380);
  const Gaussians g =
      random_gaussians(camera, {.count = 20'000, .sigma_px = 6, .anisotropy = 9}, 5);
  RenderBuffers one_thread;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    one_thread = rasterize(g, camera);
  }
  for (const size_t threads : {2, 3, 4}) {
    const tbb::global_control many(tbb::global_control::max_allowed_parallelism, threads);
    for (int repeat = 0; repeat < 3; ++repeat) {
      EXPECT_TRUE(same_bits(one_thread, rasterize(g, camera))) << threads;
    }
  }
}

TEST(Rasterize, GivesTheSamePictureForAnyPowerOfTwoScale) {
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {.sigma_px = 3, .anisotropy = 4}, 6);
  const RenderBuffers expected = rasterize(g, camera);
  for (const int exponent : {-20, -10, -1, 1, 10, 20}) {
    const float scale = std::ldexp(1.0f, exponent);
    Gaussians scaled = g;
    for (Eigen::Vector3f& p : scaled.position) p *= scale;
    for (Eigen::Vector3f& s : scaled.scale) s *= scale;
    Camera moved = camera;
    moved.world_from_cam.translation() *= double(scale);
    const RenderBuffers got = rasterize(scaled, moved, {.near_depth = 1e-3f * scale});
    EXPECT_TRUE(same_bits(got.color, expected.color)) << exponent;
    EXPECT_TRUE(same_bits(got.alpha, expected.alpha)) << exponent;
    EXPECT_TRUE(same_bits(got.strongest, expected.strongest)) << exponent;
  }
}

TEST(Rasterize, GivesTheSamePictureWhenTheWorldIsTurned) {
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {.sigma_px = 3, .anisotropy = 4}, 7);
  const RenderBuffers expected = rasterize(g, camera);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double angle : {std::numbers::pi / 2, std::numbers::pi, 1.0}) {
      const Eigen::AngleAxisd about(angle, Eigen::Vector3d::Unit(axis));
      const Eigen::Quaterniond turn(about);
      Gaussians turned = g;
      for (Eigen::Vector3f& p : turned.position) p = (turn * p.cast<double>()).cast<float>();
      for (Eigen::Vector4f& q : turned.rotation) {
        const Eigen::Quaterniond r = turn * Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
        q = Eigen::Vector4d(r.w(), r.x(), r.y(), r.z()).cast<float>();
      }
      Camera moved = camera;
      moved.world_from_cam = turn * camera.world_from_cam;
      const RenderBuffers got = rasterize(turned, moved);
      // A splat that rounding takes across alpha 1/255 may come or go; nothing else may change.
      size_t off = 0;
      for (size_t p = 0; p < got.color.data.size(); ++p) {
        const float change = (got.color.data[p] - expected.color.data[p]).cwiseAbs().maxCoeff();
        EXPECT_LE(change, 2.5f / 255);
        off += change > 1e-5f ? 1 : 0;
      }
      EXPECT_LE(off, got.color.data.size() / 100) << axis << ", " << angle;
    }
  }
}

TEST(Rasterize, DoesNotDependOnTheOrderOfGaussiansAtDifferentDepths) {
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {}, 8);
  Gaussians reversed = g;
  std::reverse(reversed.position.begin(), reversed.position.end());
  std::reverse(reversed.scale.begin(), reversed.scale.end());
  std::reverse(reversed.rotation.begin(), reversed.rotation.end());
  std::reverse(reversed.opacity.begin(), reversed.opacity.end());
  std::reverse(reversed.sh.begin(), reversed.sh.end());
  EXPECT_TRUE(same_bits(rasterize(g, camera).color, rasterize(reversed, camera).color));
}

TEST(Rasterize, LeavesDeadGaussiansOutAndCountsThem) {
  const Camera camera = oblique_camera();
  const Gaussians g = random_gaussians(camera, {.count = 100}, 9);
  Gaussians with_dead = g;
  const auto add = [&](Eigen::Vector3f scale, Eigen::Vector4f rotation, float opacity, float z) {
    with_dead.position.push_back(camera.unproject(20, 20, double(z)).cast<float>());
    with_dead.scale.push_back(scale);
    with_dead.rotation.push_back(rotation);
    with_dead.opacity.push_back(opacity);
    with_dead.sh.emplace_back(1, 1, 1);
  };
  const Eigen::Vector3f ball = Eigen::Vector3f::Constant(0.1f);
  add(Eigen::Vector3f::Zero(), {1, 0, 0, 0}, 0.9f, 0.5f);
  add(Eigen::Vector3f::Constant(kNan), {1, 0, 0, 0}, 0.9f, 0.5f);
  add(ball, Eigen::Vector4f::Zero(), 0.9f, 0.5f);
  add(ball, Eigen::Vector4f::Constant(kNan), 0.9f, 0.5f);
  add(ball, {1, 0, 0, 0}, kNan, 0.5f);
  add(ball, {1, 0, 0, 0}, 0.9f, kNan);
  add(ball, {1, 0, 0, 0}, 0.001f, 0.5f);
  add(ball, {1, 0, 0, 0}, 0.9f, -0.5f);
  RasterizerReport plain;
  RasterizerReport report;
  const RenderBuffers expected = rasterize(g, camera, {}, &plain);
  EXPECT_TRUE(same_bits(rasterize(with_dead, camera, {}, &report), expected));
  EXPECT_EQ(report.drawn, plain.drawn);
  EXPECT_EQ(report.degenerate, 6U);
  EXPECT_EQ(report.transparent, 1U);
  EXPECT_EQ(report.behind, plain.behind + 1);
  EXPECT_EQ(report.drawn + report.degenerate + report.transparent + report.behind + report.outside,
            with_dead.size());
}

void expect_background(const RenderBuffers& view, const Eigen::Vector3f& background) {
  for (size_t p = 0; p < view.alpha.data.size(); ++p) {
    EXPECT_EQ(view.color.data[p], background);
    EXPECT_EQ(view.alpha.data[p], 0);
    EXPECT_TRUE(std::isnan(view.depth.data[p]));
    EXPECT_TRUE(std::isnan(view.median_depth.data[p]));
    EXPECT_EQ(view.depth_variance.data[p], 0);
    EXPECT_EQ(view.strongest.data[p], UINT32_MAX);
  }
}

TEST(Rasterize, ShowsTheBackgroundWhereThereIsNothing) {
  const Eigen::Vector3f background(0.1f, 0.2f, 0.3f);
  Camera camera = oblique_camera();
  expect_background(rasterize({}, camera, {.background = background}), background);
  const Gaussians g = random_gaussians(camera, {}, 10);
  camera.world_from_cam.linear() *= Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).matrix();
  RasterizerReport report;
  expect_background(rasterize(g, camera, {.background = background}, &report), background);
  EXPECT_EQ(report.behind, g.size());
}

TEST(Rasterize, HasDepthOnlyWhereItIsOpaqueEnough) {
  const Camera camera = {.width = 5, .height = 5, .fx = 5, .fy = 5, .cx = 2.5, .cy = 2.5};
  Gaussians g;
  g.position = {{0, 0, 2}};
  g.scale = {{4, 4, 4}};
  g.rotation = {{1, 0, 0, 0}};
  g.sh = {{0, 0, 0}};
  for (const float opacity : {0.0f, 1e-38f, 1e-6f, 1e-3f, 0.01f, 0.45f, 0.55f, 0.9f, 1.0f}) {
    g.opacity = {opacity};
    const RenderBuffers seen = rasterize(g, camera);
    EXPECT_EQ(seen.alpha(2, 2) > 0, opacity >= 0.01f);
    EXPECT_NEAR(seen.alpha(2, 2), opacity >= 0.01f ? std::min(opacity, 0.99f) : 0, 1e-6);
    if (opacity > 0.5f) {
      EXPECT_NEAR(seen.depth(2, 2), 2, 1e-6);
      EXPECT_NEAR(seen.median_depth(2, 2), 2, 1e-6);
    } else {
      EXPECT_TRUE(std::isnan(seen.depth(2, 2))) << opacity;
      EXPECT_TRUE(std::isnan(seen.median_depth(2, 2))) << opacity;
    }
    EXPECT_GE(seen.depth_variance(2, 2), 0);
  }
}

TEST(Rasterize, LeavesTheFloatingPointModeOfTheCallerAlone) {
  const Camera camera = oblique_camera();
  rasterize(random_gaussians(camera, {}, 11), camera);
  volatile float tiny = std::numeric_limits<float>::min();
  EXPECT_GT(tiny / 2, 0);
}

}  // namespace
}  // namespace cgs::rasterizer_test
