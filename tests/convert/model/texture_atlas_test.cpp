// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/texture_atlas.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/images/image.h"
#include "io/meshes/gltf.h"
#include "io/meshes/obj.h"
#include "io/meshes/obj_reader.h"
#include "libcgs/core/error.h"
#include "tests/support/glb_file.h"
#include "tests/support/temp_dir.h"
#include "tests/support/textured_cube.h"

namespace cgs::texture_atlas_test {
namespace {

Eigen::Vector3d middle_of(const TriangleMesh& mesh, size_t face) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t v : mesh.faces[face]) sum += mesh.vertices[v].cast<double>() / 3;
  return sum;
}

// Of the pixel that shows a point.
Eigen::Vector3f color_at(const Photograph& photograph, const Eigen::Vector3d& point) {
  const Eigen::Vector3d uvz = photograph.camera.project(point);
  return photograph.image(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
}

TEST(PackedTexture, HasTheSamePixelsInOnePicture) {
  const test::TexturedBox box = test::textured_box();
  const PackedTexture packed = packed_texture(box.mesh, box.texture, 0);
  ASSERT_TRUE(packed.texture.atlas.has_value());
  const TextureAtlas& atlas = *packed.texture.atlas;
  ASSERT_EQ(packed.texture.photographs.size(), 3u) << "a side is one chart";
  for (size_t f = 0; f < box.mesh.faces.size(); ++f) {
    const int i = box.texture.of_face[f];
    ASSERT_EQ(packed.texture.of_face[f] < 0, i < 0);
    if (i < 0) continue;
    const Eigen::Vector3d p = middle_of(box.mesh, f);
    const auto chart = static_cast<size_t>(packed.texture.of_face[f]);
    EXPECT_EQ(color_at(packed.texture.photographs[chart], p),
              color_at(box.texture.photographs[static_cast<size_t>(i)], p));
  }
  // Every pixel of the picture belongs to one chart at most.
  MaskMap taken(atlas.size.x(), atlas.size.y(), 0);
  for (size_t i = 0; i < packed.texture.photographs.size(); ++i) {
    const Camera& camera = packed.texture.photographs[i].camera;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        ASSERT_EQ(taken(atlas.corner[i].x() + x, atlas.corner[i].y() + y)++, 0);
      }
    }
  }
}

TEST(PackedTexture, SplitsAPhotographWhereItsFacesDoNotTouch) {
  test::TexturedBox box = test::textured_box();
  // The side towards -z shows the third photograph: a row across it that does not cuts it in two.
  for (size_t f = 4 * 200 + 100; f < 4 * 200 + 120; ++f) box.texture.of_face[f] = -1;
  EXPECT_EQ(packed_texture(box.mesh, box.texture, 0).texture.photographs.size(), 4u);
}

TEST(PackedTexture, CutsAnIslandOutTogetherWithWhatIsAroundIt) {
  test::TexturedBox box = test::textured_box();
  for (int row = 4; row <= 6; ++row) {
    for (int column = 4; column <= 6; ++column) {
      if (row == 5 && column == 5) continue;
      const auto face = static_cast<size_t>(4 * 200 + 20 * row + 2 * column);
      box.texture.of_face[face] = box.texture.of_face[face + 1] = -1;
    }
  }
  EXPECT_EQ(packed_texture(box.mesh, box.texture, 0).texture.photographs.size(), 3u);
}

TEST(PackedTexture, MakesPixelsAsLargeAsAsked) {
  const test::TexturedBox box = test::textured_box();
  constexpr double kTexel = 0.01;
  const PackedTexture packed = packed_texture(box.mesh, box.texture, kTexel);
  EXPECT_EQ(packed.texel, kTexel);
  for (size_t f = 0; f < box.mesh.faces.size(); ++f) {
    if (packed.texture.of_face[f] < 0) continue;
    const auto chart = static_cast<size_t>(packed.texture.of_face[f]);
    const Camera& camera = packed.texture.photographs[chart].camera;
    const double pixel = camera.project(middle_of(box.mesh, f)).z() / camera.fx;
    EXPECT_GT(pixel, kTexel / 2);
    EXPECT_LT(pixel, kTexel * 2);
  }
}

// A chart of 9000 pixels is wider than a graphics card takes.
TEST(PackedTexture, GetsCoarserUntilItFits) {
  Camera camera;
  camera.width = 9000;
  camera.height = 8;
  camera.fx = camera.fy = 1;
  TriangleMesh mesh;
  mesh.vertices = {{1, 1, 1}, {8999, 1, 1}, {1, 7, 1}};
  mesh.faces = {{0, 2, 1}};
  const PhotoTexture texture = {
      {{"wide", camera, ColorImage(9000, 8, Eigen::Vector3f::Zero())}}, {0}, {}};
  const PackedTexture packed = packed_texture(mesh, texture, 0);
  EXPECT_LE(packed.texture.atlas->size.x(), kLargestAtlasSide);
  EXPECT_GT(packed.texture.atlas->size.x(), kLargestAtlasSide * 9 / 10);
  EXPECT_GT(packed.texel, 9000.0 / kLargestAtlasSide);
}

TEST(PackedTexture, LooksTheSameInAGlb) {
  const test::TexturedBox box = test::textured_box();
  GlbOptions options;
  options.jpeg_quality = 100;
  const GlbFile before = make_glb(box.mesh, box.texture, {}, options);
  const PackedTexture packed = packed_texture(box.mesh, box.texture, 0);
  const GlbFile after = make_glb(box.mesh, packed.texture, {}, options);
  const test::Glb apart = test::parse_glb(before.bytes);
  const test::Glb one = test::parse_glb(after.bytes);
  EXPECT_EQ(apart.images.size(), 3u);
  EXPECT_EQ(one.images.size(), 1u);
  EXPECT_EQ(one.json["materials"][0]["name"], "observed atlas");
  EXPECT_EQ(after.report.textured_triangles, before.report.textured_triangles);
  const Camera camera = test::camera_at({-0.7, 0.7, -0.8});
  const test::GlbPicture expected = render_glb(apart, camera);
  const test::GlbPicture found = render_glb(one, camera);
  double sum = 0;
  size_t shown = 0;
  for (size_t i = 0; i < expected.color.data.size(); ++i) {
    ASSERT_EQ(expected.part.data[i] < 0, found.part.data[i] < 0);
    if (found.part.data[i] < 0) continue;
    sum += double{(expected.color.data[i] - found.color.data[i]).cwiseAbs().maxCoeff()};
    ++shown;
  }
  EXPECT_GT(shown, 10000u);
  EXPECT_LT(sum / double(shown), 0.01);
}

TEST(PackedTexture, IsOneFileBesideAnObj) {
  const test::TempDir dir;
  const test::TexturedBox box = test::textured_box();
  const PackedTexture packed = packed_texture(box.mesh, box.texture, 0);
  write_obj(dir / "a.obj", box.mesh, packed.texture, {});
  EXPECT_EQ(test::entries(dir.path()), 3);
  EXPECT_NE(test::read_bytes(dir / "a.mtl").find("newmtl observed_atlas\n"), std::string::npos);
  EXPECT_EQ(read_image(dir / "a.atlas.jpg").width, packed.texture.atlas->size.x());
  EXPECT_EQ(read_obj(dir / "a.obj").mesh.faces.size(), box.mesh.faces.size());
}

TEST(PackedTexture, IsRefusedByWritersWhereChartsLieOutside) {
  const test::TempDir dir;
  const test::TexturedBox box = test::textured_box();
  PackedTexture packed = packed_texture(box.mesh, box.texture, 0);
  packed.texture.atlas->size.x() = 100;
  EXPECT_THROW(write_obj(dir / "a.obj", box.mesh, packed.texture, {}), InvalidInput);
  packed.texture.atlas->corner.pop_back();
  EXPECT_THROW(write_obj(dir / "a.obj", box.mesh, packed.texture, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::texture_atlas_test
