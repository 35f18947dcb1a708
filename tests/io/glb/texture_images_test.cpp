// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/texture_images.h"

#include <gtest/gtest.h>

#include "io/images/image.h"
#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"
#include "tests/support/textured_cube.h"

namespace cgs::texture_images_test {
namespace {

// A square before the camera that reaches over the given pixels.
TriangleMesh square(const Camera& camera, const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  TriangleMesh mesh;
  for (const auto& [u, v] : {std::pair(low.x(), low.y()),
                             std::pair(high.x(), low.y()),
                             std::pair(high.x(), high.y()),
                             std::pair(low.x(), high.y())}) {
    mesh.vertices.push_back(camera.unproject(u, v, 2).cast<float>());
  }
  mesh.faces = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

PhotoTexture texture_of(const Camera& camera, const Eigen::Vector3f& color) {
  PhotoTexture texture;
  texture.photographs = {{"grey", camera, ColorImage(camera.width, camera.height, color)}};
  texture.of_face = {0, 0};
  return texture;
}

ColorImage decoded(const std::string& jpeg) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.jpg", jpeg);
  return read_image(dir / "a.jpg");
}

TEST(TextureImages, KeepTheGreyOfAGreyCard) {
  const Camera camera = test::camera_at({0, 0, -1});
  const TriangleMesh mesh = square(camera, {100, 90}, {200, 150});
  for (const int grey : {0, 1, 127, 128, 200, 255}) {
    const auto level = static_cast<float>(grey) / 255.0f;
    const auto images =
        texture_images(mesh, texture_of(camera, Eigen::Vector3f::Constant(level)), 90);
    ASSERT_EQ(images.size(), 1u);
    for (const Eigen::Vector3f& color : decoded(images[0].jpeg).data) {
      EXPECT_LE((color.array() - level).abs().maxCoeff(), 1.01f / 255.0f) << grey;
    }
  }
}

TEST(TextureImages, HoldTheUsedRectangleWithPadding) {
  const Camera camera = test::camera_at({0, 0, -1});
  PhotoTexture texture = texture_of(camera, Eigen::Vector3f::Zero());
  ColorImage& image = texture.photographs[0].image;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image(x, y) = {static_cast<float>(x) / 320, static_cast<float>(y) / 240, 0.5f};
    }
  }
  struct Case {
    Eigen::Vector2d low, high;
  };
  for (const Case& c : {Case{{100.3, 90.7}, {200.2, 150.1}},
                        Case{{1, 1}, {40, 30}},
                        Case{{300, 200}, {319.5, 239.5}},
                        Case{{1, 1}, {319, 239}}}) {
    const TextureImage out = texture_images(square(camera, c.low, c.high), texture, 95)[0];
    const Eigen::Vector2i end = out.corner + out.size;
    for (int k = 0; k < 2; ++k) {
      const int limit = k == 0 ? 320 : 240;
      EXPECT_LE(out.corner[k], std::max(0.0, c.low[k] - 8));
      EXPECT_GE(end[k], std::min<double>(limit, c.high[k] + 8));
      EXPECT_GE(out.corner[k], std::max(0.0, c.low[k] - 24));
      EXPECT_LE(end[k], limit);
      EXPECT_LE(end[k], c.high[k] + 25);
    }
    const ColorImage crop = decoded(out.jpeg);
    ASSERT_EQ(crop.width, out.size.x());
    ASSERT_EQ(crop.height, out.size.y());
    for (const Eigen::Vector2d& pixel : {c.low, c.high, Eigen::Vector2d((c.low + c.high) / 2)}) {
      const Eigen::Vector2f t = out.texcoord({pixel.x(), pixel.y(), 1});
      const auto x = static_cast<int>(t.x() * static_cast<float>(crop.width));
      const auto y = static_cast<int>(t.y() * static_cast<float>(crop.height));
      const Eigen::Vector3f& before = image(int(pixel.x()), int(pixel.y()));
      EXPECT_LT((crop(x, y) - before).cwiseAbs().maxCoeff(), 0.02f);
    }
  }
}

TEST(TextureImages, FillWhatNoFaceIsNearWithTheMeanOfTheRest) {
  const Camera camera = test::camera_at({0, 0, -1});
  TriangleMesh mesh = square(camera, {10, 10}, {30, 30});
  const TriangleMesh other = square(camera, {280, 200}, {300, 220});
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  mesh.faces.push_back({4, 6, 5});
  PhotoTexture texture = texture_of(camera, Eigen::Vector3f(0, 1, 0));
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) texture.photographs[0].image(x, y) = {0.5f, 0.5f, 0.5f};
  }
  for (int y = 170; y < 240; ++y) {
    for (int x = 250; x < 320; ++x) texture.photographs[0].image(x, y) = {0.5f, 0.5f, 0.5f};
  }
  texture.of_face = {0, 0, 0};
  const TextureImage out = texture_images(mesh, texture, 90)[0];
  for (const Eigen::Vector3f& color : decoded(out.jpeg).data) {
    EXPECT_LT((color.array() - 0.5f).abs().maxCoeff(), 0.01f);  // the green is gone
  }
}

TEST(TextureImages, AreEmptyForPhotographsThatNoFaceUses) {
  const Camera camera = test::camera_at({0, 0, -1});
  PhotoTexture texture = texture_of(camera, Eigen::Vector3f::Ones());
  texture.photographs.push_back(texture.photographs[0]);
  texture.of_face = {1, PhotoTexture::kNone};
  const auto images = texture_images(square(camera, {100, 90}, {200, 150}), texture, 90);
  EXPECT_TRUE(images[0].jpeg.empty());
  EXPECT_FALSE(images[1].jpeg.empty());
}

TEST(RequireTexture, RefusesWhatDoesNotFitTheMesh) {
  const Camera camera = test::camera_at({0, 0, -1});
  const TriangleMesh mesh = square(camera, {100, 90}, {200, 150});
  const PhotoTexture good = texture_of(camera, Eigen::Vector3f::Ones());
  const auto refused = [&](const auto& spoil) {
    PhotoTexture texture = good;
    spoil(texture);
    EXPECT_THROW(require_texture(mesh, texture, "test"), InvalidInput);
  };
  require_texture(mesh, good, "test");
  require_texture(mesh, {}, "test");
  refused([](PhotoTexture& t) { t.of_face.pop_back(); });
  refused([](PhotoTexture& t) { t.of_face[0] = 1; });
  refused([](PhotoTexture& t) { t.of_face[0] = -2; });
  refused([](PhotoTexture& t) { t.photographs[0].image = ColorImage(3, 3, {0, 0, 0}); });
  refused([](PhotoTexture& t) { t.photographs[0].image = {}; });
  refused([](PhotoTexture& t) { t.photographs[0].camera.cx += 150; });  // a corner leaves it
  refused([](PhotoTexture& t) {
    t.photographs[0].camera.world_from_cam.translation().z() = 5;  // behind it
  });
}

}  // namespace
}  // namespace cgs::texture_images_test
