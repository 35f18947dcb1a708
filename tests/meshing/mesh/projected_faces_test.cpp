// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/projected_faces.h"

#include <gtest/gtest.h>

#include "tests/support/textured_cube.h"

namespace cgs::projected_faces_test {
namespace {

TEST(NearnessMap, AgreesWithRays) {
  const Camera camera = test::camera_at({0.5, 0.6, -0.9});
  const Raster<float> map = nearness_map(projected_faces(test::box(3), camera), 320, 240);
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2));
  int differ = 0;
  int hit = 0;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const Eigen::Vector3d ray =
          camera.world_from_cam.linear() * camera.ray_in_cam(x + 0.5, y + 0.5);
      const double z = test::hit_box(camera.center(), ray, bounds);  // ray has z = 1
      if (std::isfinite(z) != (map(x, y) > 0)) {
        ++differ;  // outlines that pass through a pixel centre
        continue;
      }
      if (!std::isfinite(z)) continue;
      ++hit;
      EXPECT_NEAR(map(x, y) * z, 1, 1e-5);
    }
  }
  EXPECT_GT(hit, 5000);
  EXPECT_LE(differ, 2);
}

TEST(ProjectedFaces, TellWhatLiesBehindTheCamera) {
  const Camera inside = test::camera_at({0, 0, 0}, {0, 0, 1});
  const auto faces = projected_faces(test::box(1), inside);
  for (size_t f = 0; f < faces.size(); ++f) EXPECT_EQ(faces[f].in_front, f / 2 == 5) << f;
}

// 1 / z where the ray of a pixel meets a triangle before a camera at the origin, else 0.
double nearness_by_ray(const TriangleMesh& mesh, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d a = mesh.vertices[0].cast<double>();
  Eigen::Matrix3d sides;
  sides << mesh.vertices[1].cast<double>() - a, mesh.vertices[2].cast<double>() - a, -ray;
  const Eigen::Vector3d at = sides.inverse() * -a;
  const bool meets = at.x() >= 0 && at.y() >= 0 && at.x() + at.y() <= 1 && at.z() > 0;
  return meets ? 1 / at.z() : 0;
}

TEST(NearnessMap, HoldsWhatLiesBeforeTheCameraOfAFaceThatReachesBehindIt) {
  const Camera camera = test::camera_at({0, 0, 0}, {0, 0, 1});
  TriangleMesh one_behind;  // the camera's axes are those of the world: y is down
  one_behind.vertices = {{-20, 0.5f, 20}, {20, 0.5f, 20}, {0, 0.5f, -5}};
  TriangleMesh two_behind;
  two_behind.vertices = {{-2, 0.5f, -5}, {2, 0.5f, -5}, {0.3f, 0.5f, 20}};
  for (TriangleMesh* mesh : {&one_behind, &two_behind}) {
    mesh->faces = {{0, 1, 2}};
    const Raster<float> map = nearness_map(*mesh, camera, projected_faces(*mesh, camera));
    int differ = 0;
    int hit = 0;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double expected = nearness_by_ray(*mesh, camera.ray_in_cam(x + 0.5, y + 0.5));
        if ((expected > 0) != (map(x, y) > 0)) ++differ;  // outlines through a pixel centre
        if (!(expected > 0) || !(map(x, y) > 0)) continue;
        ++hit;
        EXPECT_NEAR(double(map(x, y)) / expected, 1, 1e-5);
      }
    }
    EXPECT_GT(hit, 5000);
    EXPECT_LE(differ, 2);
  }
}

TEST(ForEachPixel, WeighsTheCorners) {
  const ProjectedFace face{{Eigen::Vector3f(0, 0, 1), {8, 0, 2}, {0, 8, 3}}, true};
  int pixels = 0;
  for_each_pixel(
      face, {0, 0, 100, 100}, [&](int x, int y, const Eigen::Vector3f& w, float nearness) {
        ++pixels;
        EXPECT_NEAR(8 * w.y(), static_cast<float>(x) + 0.5f, 1e-5);
        EXPECT_NEAR(8 * w.z(), static_cast<float>(y) + 0.5f, 1e-5);
        EXPECT_NEAR(w.sum(), 1, 1e-5);
        EXPECT_NEAR(nearness, w.x() + 2 * w.y() + 3 * w.z(), 1e-5);
      });
  EXPECT_EQ(pixels, 36);  // centres on the slanted edge count
  pixels = 0;
  for_each_pixel(face, {2, 1, 4, 3}, [&](int, int, const Eigen::Vector3f&, float) { ++pixels; });
  EXPECT_EQ(pixels, 4);
}

}  // namespace
}  // namespace cgs::projected_faces_test
