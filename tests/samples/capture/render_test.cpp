// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/render.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "samples/capture/solids.h"
#include "samples/capture/truth.h"

namespace cgs::render_test {
namespace {

using Eigen::Vector3d;

PortalScene step_and_ball() {
  PortalScene scene;
  TriangleMesh ground = box({-3, -3, -1}, {3, 3, 0});
  refine(ground, 0.3);
  add_part(scene, "ground", Material::Paving, ground);
  TriangleMesh block = box({-0.5, -0.5, -0.1}, {0.5, 0.5, 1});
  refine(block, 0.2);
  add_part(scene, "block", Material::Carved, block);
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

// Standard deviation of the grey level [1/255] within 7 x 7 pixels about (x, y).
double local_contrast(const ColorImage& image, int x, int y) {
  double sum = 0;
  double squares = 0;
  for (int dy = -3; dy <= 3; ++dy) {
    for (int dx = -3; dx <= 3; ++dx) {
      const double grey = 255 * static_cast<double>(image(x + dx, y + dy).mean());
      sum += grey;
      squares += grey * grey;
    }
  }
  return std::sqrt(std::max(0.0, squares / 49 - sum * sum / 49 / 49));
}

TEST(SkyVisibility, IsFullInTheOpenAndHalfAtTheFootOfAWall) {
  const PortalScene scene = step_and_ball();
  const auto sky = sky_visibility(scene);
  for (size_t v = 0; v < sky.size(); ++v) {
    const Eigen::Vector3f p = scene.mesh.vertices[v];
    if (p.z() != 0 && p.z() != 1) continue;
    if (p.z() == 1 && p.head<2>().cwiseAbs().maxCoeff() < 0.4F) EXPECT_EQ(sky[v], 1);
    if (p.z() == 0 && p.head<2>().cwiseAbs().maxCoeff() < 0.4F) EXPECT_LT(sky[v], 0.3F);  // inside
    const bool beside = p.z() == 0 && std::abs(p.x()) < 0.2F && std::abs(p.y() + 0.6F) < 0.1F;
    if (beside) EXPECT_NEAR(sky[v], 0.6F, 0.2F);
  }
}

TEST(RenderView, GivesTheSameBitsForAnyNumberOfThreads) {
  const PortalScene scene = step_and_ball();
  const Camera camera = capture_views(6)[1].camera;
  const auto render = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return render_view(scene, sky_visibility(scene), camera, 3); });
  };
  const ColorImage one = render(1);
  const ColorImage three = render(3);
  ASSERT_EQ(one.data.size(), three.data.size());
  for (size_t i = 0; i < one.data.size(); ++i) ASSERT_EQ(one.data[i], three.data[i]) << i;
}

TEST(RenderView, DiffersOnlyByNoiseBetweenSeeds) {
  const PortalScene scene = step_and_ball();
  const std::vector<float> sky(scene.mesh.vertices.size(), 1.0F);
  const Camera camera = capture_views(6)[1].camera;
  const ColorImage a = render_view(scene, sky, camera, 3);
  const ColorImage b = render_view(scene, sky, camera, 4);
  double squares = 0;
  int64_t counted = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    if (a.data[i].maxCoeff() < 0.1F || a.data[i].maxCoeff() > 0.95F) continue;
    squares += 255.0 * 255.0 * static_cast<double>((a.data[i] - b.data[i]).squaredNorm());
    counted += 3;
  }
  ASSERT_GT(counted, 1000);
  // Two noises of 0.5 and two roundings of 1 / sqrt(12).
  EXPECT_NEAR(squares / static_cast<double>(counted), 2 * (0.25 + 1.0 / 12), 0.1);
}

TEST(RenderView, ShowsASurfaceAlikeFromTwoSides) {
  const PortalScene scene = portal_scene();
  const std::vector<float> sky(scene.mesh.vertices.size(), 0.8F);
  const auto views = capture_views(2);
  const ColorImage left = render_view(scene, sky, views[0].camera, 1);
  const ColorImage right = render_view(scene, sky, views[2].camera, 2);
  const std::vector<Camera> both{views[0].camera, views[2].camera};
  const ViewTruth truth = view_truth(scene, views[0].camera, both);
  std::vector<Eigen::Vector2d> grey;  // of the same point in both pictures
  for (int y = 0; y < left.height; ++y) {
    for (int x = 0; x < left.width; ++x) {
      if (truth.seen(x, y) < 2) continue;
      const auto depth = static_cast<double>(truth.depth(x, y));
      const Vector3d uvz =
          views[2].camera.project(views[0].camera.unproject(x + 0.5, y + 0.5, depth));
      const float other = right(static_cast<int>(uvz.x()), static_cast<int>(uvz.y())).mean();
      grey.emplace_back(left(x, y).mean(), other);
    }
  }
  ASSERT_GT(grey.size(), 10000U);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& g : grey) mean += g / static_cast<double>(grey.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const auto& g : grey) covariance += (g - mean) * (g - mean).transpose();
  // Taking the nearest pixel shifts the texture by up to half a pixel, hence not 1.
  EXPECT_GT(covariance(0, 1) / std::sqrt(covariance(0, 0) * covariance(1, 1)), 0.8);
  EXPECT_NEAR(mean.x(), mean.y(), 0.01);
}

TEST(RenderView, HasTextureNearlyEverywhere) {
  const PortalScene scene = portal_scene();
  const std::vector<float> sky(scene.mesh.vertices.size(), 0.8F);
  const ColorImage image = render_view(scene, sky, capture_views()[1].camera, 1);
  int textured = 0;
  int counted = 0;
  int clipped = 0;
  for (int y = 3; y + 3 < image.height; ++y) {
    for (int x = 3; x + 3 < image.width; ++x) {
      ++counted;
      textured += local_contrast(image, x, y) > 4 ? 1 : 0;
      clipped += image(x, y).minCoeff() >= 1 ? 1 : 0;
    }
  }
  EXPECT_GT(textured, 0.97 * counted);
  EXPECT_LT(clipped, 0.01 * counted);
}

}  // namespace
}  // namespace cgs::render_test
