// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::projection_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Camera camera_at(const Eigen::Vector3d& center) {
  Camera camera{.width = 100, .height = 80, .fx = 90, .fy = 85, .cx = 47, .cy = 42};
  camera.world_from_cam.translation() = center;
  return camera;
}

void add(Gaussians& g, const Eigen::Vector3f& position, const Eigen::Vector3f& scale) {
  g.position.push_back(position);
  g.scale.push_back(scale);
  g.rotation.emplace_back(1, 0, 0, 0);
  g.opacity.push_back(0.5f);
  g.sh.emplace_back(0, 0, 0);
}

Gaussians one(const Eigen::Vector3f& position, const Eigen::Vector3f& scale) {
  Gaussians g;
  add(g, position, scale);
  return g;
}

// The image covariance that a footprint stands for.
Eigen::Matrix2d image_covariance(const Splat& s) {
  const double yy = 1 / (double(s.inv_sigma_y) * double(s.inv_sigma_y));
  const double xy = s.slope * yy;
  Eigen::Matrix2d out;
  out << double(s.sigma_x) * double(s.sigma_x) + s.slope * xy, xy, xy, yy;
  return out;
}

TEST(ProjectionOptions, AreValidByDefaultAndRefuseEachFieldOutOfRange) {
  EXPECT_NO_THROW(ProjectionOptions{}.validate());
  for (const float bad : {-1.0f, kNan, std::numeric_limits<float>::infinity()}) {
    EXPECT_THROW(ProjectionOptions{.dilation = bad}.validate(), InvalidInput);
    EXPECT_THROW(ProjectionOptions{.near_depth = bad}.validate(), InvalidInput);
  }
  EXPECT_THROW(ProjectionOptions{.near_depth = 0}.validate(), InvalidInput);
}

TEST(ProjectGaussians, PutsTheGaussianOfAPixelOnItsCentre) {
  for (const double far : {0.0, 1000.0}) {  // a camera far from the origin loses nothing
    const Camera camera = camera_at({far, -far, 0});
    for (int y = 0; y < camera.height; y += 13) {
      for (int x = 0; x < camera.width; x += 17) {
        const Eigen::Vector3d p = camera.unproject(x + 0.5, y + 0.5, 0.75);
        const Gaussians g = one(p.cast<float>(), Eigen::Vector3f::Constant(0.01f));
        const ProjectedGaussians projected = project_gaussians(g, camera);
        // Rounding the position to float moves the pixel; projecting it must not.
        const Eigen::Vector3d rounded = g.position[0].cast<double>();
        const Eigen::Vector3d truth = camera.project(rounded);
        EXPECT_NEAR(projected.splats[0].u, truth.x(), 1e-9);
        EXPECT_NEAR(projected.splats[0].v, truth.y(), 1e-9);
        if (far == 0) EXPECT_NEAR(projected.splats[0].u, x + 0.5, 1e-5);
        if (far == 0) EXPECT_NEAR(projected.splats[0].v, y + 0.5, 1e-5);
      }
    }
  }
}

TEST(ProjectGaussians, OfExactPositionsGivesExactPixelCentres) {
  Camera camera{.width = 64, .height = 32, .fx = 64, .fy = 64, .cx = 32, .cy = 16};
  for (int x = 0; x < 64; ++x) {
    const Eigen::Vector3f p =
        camera.unproject(x + 0.5, 8.5, 0.5).cast<float>();  // representable in float
    EXPECT_EQ(project_gaussians(one(p, {0.1f, 0.1f, 0.1f}), camera).splats[0].u, x + 0.5);
  }
}

TEST(ProjectGaussians, MatchesTheCovarianceOfSampledPoints) {
  // Points drawn from a small Gaussian and projected exactly: the affine map is then good.
  const Camera camera = camera_at({0.1, 0, -0.2});
  Gaussians g = one({0.2f, -0.1f, 0.6f}, {0.004f, 0.001f, 0.002f});
  g.rotation[0] = {0.7f, 0.1f, -0.5f, 0.4f};
  const Eigen::Matrix3d R = rotation_matrix(g.rotation[0]).cast<double>();
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  constexpr int kSamples = 200'000;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3d local(
        0.004 * normal(random), 0.001 * normal(random), 0.002 * normal(random));
    const Eigen::Vector3d world = g.position[0].cast<double>() + R * local;
    const Eigen::Vector2d uv = camera.project(world).head<2>();
    mean += uv / kSamples;
    square += uv * uv.transpose() / kSamples;
  }
  const Eigen::Matrix2d expected = square - mean * mean.transpose();
  const auto projected = project_gaussians(g, camera, {.dilation = 0.3f});
  const Eigen::Matrix2d got =
      image_covariance(projected.splats[0]) - 0.3 * Eigen::Matrix2d::Identity();
  EXPECT_LT((got - expected).norm(), 0.01 * expected.norm()) << got << "\n" << expected;
}

TEST(ProjectGaussians, TreatsEqualScalesLikeAnyOthers) {
  const Camera camera = camera_at({0, 0, 0});
  Gaussians g = one({0.2f, 0.1f, 0.5f}, {0.01f, 0.01f, 0.01f});
  g.rotation[0] = {0.3f, 0.2f, 0.9f, -0.4f};
  const Eigen::Matrix2d ball = image_covariance(project_gaussians(g, camera).splats[0]);
  g.scale[0].x() = std::nextafter(0.01f, 1.0f);
  const Eigen::Matrix2d general = image_covariance(project_gaussians(g, camera).splats[0]);
  EXPECT_LT((ball - general).norm(), 1e-6 * ball.norm());
}

TEST(ProjectGaussians, NamesWhatBecameOfEachGaussian) {
  const Eigen::Vector3f ball = Eigen::Vector3f::Constant(0.01f);
  Gaussians g;
  add(g, {0, 0, 0.5f}, ball);
  add(g, {0, 0, -0.5f}, ball);
  add(g, {0, 0, 0}, ball);
  add(g, {5, 0, 0.5f}, ball);
  add(g, {kNan, 0, 0.5f}, ball);
  add(g, {0, 0, 0.5f}, {0, 0, 0});
  add(g, {0, 0, 0.5f}, {0.1f, -0.1f, 0.1f});
  add(g, {0, 0, 0.5f}, {0.1f, 0.1f, 0});  // flat, which is fine
  add(g, {0, 0, 0.5f}, ball);
  g.rotation.back().setZero();
  add(g, {0, 0, 0.5f}, ball);
  g.rotation.back() = {1, kNan, 0, 0};
  add(g, {0, 0, 0.5f}, ball);
  g.opacity.back() = 0.003f;
  add(g, {0, 0, 0.5f}, ball);
  g.sh.back().x() = kNan;
  using enum SplatFate;
  const std::vector<SplatFate> expected = {Drawn,
                                           Behind,
                                           Behind,
                                           Outside,
                                           Degenerate,
                                           Degenerate,
                                           Degenerate,
                                           Drawn,
                                           Degenerate,
                                           Degenerate,
                                           Transparent,
                                           Degenerate};
  EXPECT_EQ(project_gaussians(g, camera_at({0, 0, 0})).fate, expected);
}

TEST(ProjectGaussians, CullsAtTheNearDepthAndStaysFiniteJustBehindIt) {
  for (const double z : {1e-3 * (1 - 1e-6), 1e-3, 1e-3 * (1 + 1e-6), 1e-6, 0.0, -1e-6, -1.0}) {
    const Gaussians g = one({0.001f, 0.001f, float(z)}, {0.1f, 0.2f, 0.3f});
    const auto projected = project_gaussians(g, camera_at({0, 0, 0}));
    EXPECT_EQ(projected.fate[0], z >= 1e-3 ? SplatFate::Drawn : SplatFate::Behind) << z;
    if (z >= 1e-3) EXPECT_TRUE(image_covariance(projected.splats[0]).allFinite());
  }
}

TEST(ProjectGaussians, TakesQuaternionsOfAnyLength) {
  const Camera camera = camera_at({0, 0, 0});
  Gaussians g = one({0.1f, 0.1f, 0.5f}, {0.1f, 0.01f, 0.03f});
  const Eigen::Vector4f unit = Eigen::Vector4f(0.2f, -0.4f, 0.8f, 0.1f).normalized();
  g.rotation[0] = unit;
  const Eigen::Matrix2d expected = image_covariance(project_gaussians(g, camera).splats[0]);
  for (const float length : {1e-30f, 1e-20f, 1e-10f, 1e10f, 1e20f, 1e30f}) {
    g.rotation[0] = length * unit;
    const auto projected = project_gaussians(g, camera);
    ASSERT_EQ(projected.fate[0], SplatFate::Drawn) << length;
    EXPECT_LT((image_covariance(projected.splats[0]) - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST(ProjectGaussians, KeepsNeedlesPositiveDefinite) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  const Camera camera = camera_at({0, 0, 0});
  for (const float anisotropy : {1e2f, 1e4f, 1e6f}) {
    for (int i = 0; i < 1000; ++i) {
      const float longest = 1e4f / 90;  // 1e4 pixels at depth 1
      Gaussians g = one({0, 0, 1}, {longest, longest / anisotropy, longest / anisotropy});
      g.rotation[0] = {normal(random), normal(random), normal(random), normal(random)};
      const auto projected = project_gaussians(g, camera);
      ASSERT_EQ(projected.fate[0], SplatFate::Drawn);
      // det >= dilation * trace, so the conditional width is at least the root of the dilation.
      EXPECT_GE(projected.splats[0].sigma_x, std::sqrt(0.3f) * (1 - 1e-6f));
    }
  }
}

TEST(ProjectGaussians, RefusesArraysOfUnequalLengthAndUnusableCameras) {
  const Gaussians good = one({0, 0, 1}, {1, 1, 1});
  Gaussians bad = good;
  bad.opacity.clear();
  EXPECT_THROW(project_gaussians(bad, camera_at({0, 0, 0})), InvalidInput);
  bad = good;
  bad.sh_degree = 1;
  EXPECT_THROW(project_gaussians(bad, camera_at({0, 0, 0})), InvalidInput);
  bad.sh_degree = 4;
  EXPECT_THROW(project_gaussians(bad, camera_at({0, 0, 0})), InvalidInput);
  EXPECT_THROW(project_gaussians(good, Camera{}), InvalidInput);
}

TEST(DepthOrder, EqualsAStableSortAndLeavesOutWhatIsNotDrawn) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0.0015f, 2);
  Gaussians g;
  for (int i = 0; i < 5000; ++i) {
    const float z = i % 3 == 0 ? 0.5f : uniform(random);
    add(g, {0, 0, i % 10 == 0 ? -z : z}, Eigen::Vector3f::Constant(0.01f));
  }
  std::vector<uint32_t> expected;
  for (uint32_t i = 0; i < g.size(); ++i) {
    if (g.position[i].z() > 0) expected.push_back(i);
  }
  std::stable_sort(expected.begin(), expected.end(), [&](uint32_t a, uint32_t b) {
    return g.position[a].z() < g.position[b].z();
  });
  EXPECT_EQ(depth_order(project_gaussians(g, camera_at({0, 0, 0}))), expected);
}

}  // namespace
}  // namespace cgs::projection_test
