// SPDX-License-Identifier: GPL-3.0-or-later
//
// What io/meshes/gltf.h writes of meshes with photographs on them.
#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/glb/texture_images.h"
#include "io/meshes/gltf.h"
#include "libcgs/core/error.h"
#include "tests/support/glb_file.h"
#include "tests/support/largest.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/temp_dir.h"
#include "tests/support/textured_cube.h"

namespace cgs::textured_gltf_test {
namespace {

using test::Glb;
using test::in_world;
using Part = test::GlbPart;

struct WrittenBox {
  test::TexturedBox box = test::textured_box();
  GlbReport report;
  Glb glb;
  explicit WrittenBox(const GlbOptions& options, const Frame& frame = {}) {
    const test::TempDir dir;
    report = write_glb(dir / "a.glb", box.mesh, box.texture, frame, options);
    glb = test::parse_glb(test::read_bytes(dir / "a.glb"));
  }
};

TEST(WriteTexturedGlb, HasAPrimitiveAndMaterialForEachPhotograph) {
  for (const GlbEncoding encoding : {GlbEncoding::Plain, GlbEncoding::Draco}) {
    const WrittenBox out({.encoding = encoding});
    std::vector<std::string> names;
    for (const Part& part : out.glb.parts) {
      names.push_back(part.material);
      const auto& pbr = part.material_json["pbrMetallicRoughness"];
      EXPECT_EQ(pbr["metallicFactor"], 0) << part.material;
      EXPECT_EQ(pbr.contains("baseColorTexture"), part.values.count("TEXCOORD_0") == 1);
      EXPECT_NE(part.values.count("TEXCOORD_0"), part.values.count("COLOR_0"));
      const bool unlit = part.material_json.contains("extensions") &&
                         part.material_json["extensions"].contains("KHR_materials_unlit");
      EXPECT_EQ(unlit, part.material != "inferred") << part.material;
      const bool has_normals = encoding == GlbEncoding::Plain || !unlit;
      EXPECT_EQ(part.values.count("NORMAL"), has_normals ? 1u : 0u) << part.material;
    }
    EXPECT_EQ(names,
              (std::vector<std::string>{"observed left side",
                                        "observed top",
                                        "observed front",
                                        "observed",
                                        "single view",
                                        "inferred"}));
    EXPECT_EQ(out.glb.images.size(), 3u);
    EXPECT_EQ(out.report.textured_triangles, 600u);
    EXPECT_EQ(out.report.triangles, 1200u);
    EXPECT_GT(out.report.texture_bytes, 3000u);
    const auto& sampler = out.glb.json["samplers"][0];
    EXPECT_EQ(sampler["wrapS"], 33071);  // clamp to edge
    const auto required = out.glb.json.value("extensionsRequired", std::vector<std::string>());
    EXPECT_EQ(std::count(required.begin(), required.end(), "KHR_materials_unlit"), 0);
  }
}

TEST(WriteTexturedGlb, TextureCoordinatesAreTheProjections) {
  for (const GlbEncoding encoding : {GlbEncoding::Plain, GlbEncoding::Draco}) {
    const WrittenBox out({.encoding = encoding}, test::centimetre_frame());
    const auto images = texture_images(out.box.mesh, out.box.texture, 90);
    double worst = 0;
    for (const Part& part : out.glb.parts) {
      if (part.image < 0) continue;
      const auto i = static_cast<size_t>(part.image);
      const Photograph& photograph = out.box.texture.photographs[i];
      EXPECT_EQ(part.material, "observed " + photograph.name);
      EXPECT_EQ(out.glb.images[i].width, images[i].size.x());
      EXPECT_EQ(out.glb.images[i].height, images[i].size.y());
      for (size_t v = 0; v < part.values.at("TEXCOORD_0").size(); ++v) {
        // The nearest vertex of the mesh, by trying all.
        const Eigen::Vector3d p = test::centimetre_frame().internal_from_world(
            in_world(out.glb, part.values.at("POSITION")[v]));
        Eigen::Vector3d nearest = out.box.mesh.vertices[0].cast<double>();
        for (const auto& q : out.box.mesh.vertices) {
          if ((q.cast<double>() - p).norm() < (nearest - p).norm()) nearest = q.cast<double>();
        }
        const Eigen::Vector3d expected = photograph.camera.project(nearest);
        const auto& t = part.values.at("TEXCOORD_0")[v];
        const Eigen::Vector2d found =
            images[i].corner.cast<double>() +
            Eigen::Vector2d(t[0] * double(images[i].size.x()), t[1] * double(images[i].size.y()));
        worst = test::largest(worst, (found - expected.head<2>()).norm());
      }
    }
    EXPECT_LE(worst, 0.1);
    EXPECT_NEAR(worst, out.report.measured_texture_error, 1e-3);
    if (encoding == GlbEncoding::Plain) EXPECT_LT(worst, 1e-3);
  }
}

TEST(WriteTexturedGlb, LooksLikeTheThingFromAnotherCamera) {
  // A viewer on one side, rays and the formula of the pattern on the other.
  const WrittenBox out({});
  const Camera camera = test::camera_at({-0.55, 0.65, -0.8});
  const test::GlbPicture picture = test::render_glb(out.glb, camera);
  const View truth = test::photograph(
      "truth",
      camera,
      {Eigen::AlignedBox3d(Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2))});
  double sum = 0;
  int count = 0;
  for (size_t p = 0; p < picture.color.data.size(); ++p) {
    const int part = picture.part.data[p];
    if (part < 0 || out.glb.parts[static_cast<size_t>(part)].image < 0) continue;
    // Far from the edges of the pattern, where a picture of another resolution must agree.
    const Eigen::Vector3f error = (picture.color.data[p] - truth.image.data[p]).cwiseAbs();
    sum += error.maxCoeff() < 0.04f ? 1 : 0;
    ++count;
  }
  EXPECT_GT(count, 8000);
  EXPECT_GT(sum / count, 0.85);  // the rest lies on edges
}

TEST(WriteTexturedGlb, SharesBordersWithTheUntexturedRest) {
  const WrittenBox out({});
  std::set<std::vector<float>> places;
  for (const Part& part : out.glb.parts) {
    const auto& p = part.values.at("POSITION");
    places.insert(p.begin(), p.end());
  }
  std::set<std::array<float, 3>> before;
  for (const auto& v : out.box.mesh.vertices) before.insert({v.x(), v.y(), v.z()});
  EXPECT_EQ(places.size(), before.size());
}

TEST(WriteTexturedGlb, RefusesWhatDoesNotFit) {
  const test::TempDir dir;
  test::TexturedBox box = test::textured_box();
  EXPECT_THROW(write_glb(dir / "a.glb", box.mesh, box.texture, {}, {.jpeg_quality = 0}),
               InvalidInput);
  EXPECT_THROW(write_glb(dir / "a.glb", box.mesh, box.texture, {}, {.jpeg_quality = 101}),
               InvalidInput);
  box.texture.of_face[0] = 3;
  EXPECT_THROW(write_glb(dir / "a.glb", box.mesh, box.texture, {}), InvalidInput);
  EXPECT_EQ(test::entries(dir.path()), 0);
}

}  // namespace
}  // namespace cgs::textured_gltf_test
