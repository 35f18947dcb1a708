// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_colors.h"

#include <cstring>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/bytes/byte_writer.h"
#include "io/images/png.h"
#include "io/meshes/glb_reader.h"
#include "libcgs/core/srgb.h"
#include "tests/support/full_disk.h"
#include "tests/support/triangle_glb.h"

namespace cgs::glb_colors_test {
namespace {

using Json = nlohmann::json;

/// The triangle with texture coordinates and a texture of 2 x 2 pixels: red, green, blue, white.
struct TexturedTriangle : test::TriangleGlb {
  TexturedTriangle() {
    const test::TempDir dir;
    ColorImage image(2, 2, Eigen::Vector3f::Ones());
    image(0, 0) = {1, 0, 0};
    image(1, 0) = {0, 1, 0};
    image(0, 1) = {0, 0, 1};
    write_png(dir / "a.png", image);
    const std::string png = test::read_bytes(dir / "a.png");
    const size_t at = binary.size();
    for (const float c : {0.25f, 0.25f, 0.75f, 0.25f, 0.5f, 0.5f}) append_bytes(binary, c);
    binary += png;
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", 24}});
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", at + 24}, {"byteLength", png.size()}});
    json["buffers"][0]["byteLength"] = binary.size();
    json["accessors"].push_back(
        {{"bufferView", 2}, {"componentType", 5126}, {"count", 3}, {"type", "VEC2"}});
    json["images"] = {{{"bufferView", 3}, {"mimeType", "image/png"}}};
    json["textures"] = {{{"source", 0}}};
    material()["baseColorTexture"] = {{"index", 0}};
    Json& primitive = json["meshes"][0]["primitives"][0];
    primitive["material"] = 0;
    primitive["attributes"].erase("COLOR_0");
    primitive["attributes"]["TEXCOORD_0"] = 3;
  }
  GlbMesh read() const {
    const test::TempDir dir;
    test::write_bytes(dir / "a.glb", bytes());
    return read_glb(dir / "a.glb");
  }
  Json& material() { return json["materials"][0]["pbrMetallicRoughness"]; }
  std::vector<Eigen::Vector3f> linear_colors() const {
    std::vector<Eigen::Vector3f> out = read().parsed.mesh.colors;
    for (Eigen::Vector3f& color : out) {
      for (float& c : color) c = linear_from_srgb(c);
    }
    return out;
  }
};

TEST(GlbColors, VerticesTakeTheColoursOfTexturesAndMaterials) {
  TexturedTriangle t;
  auto colors = t.linear_colors();
  ASSERT_EQ(colors.size(), 3U);
  EXPECT_TRUE(t.read().parsed.has_textures);
  EXPECT_LT((colors[0] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-5f);
  EXPECT_LT((colors[1] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-5f);
  EXPECT_LT((colors[2] - Eigen::Vector3f(0.5f, 0.5f, 0.5f)).norm(), 1e-5f)
      << "mean in linear light";
  t.material()["baseColorFactor"] = {0.5, 1, 1, 1};
  EXPECT_NEAR(t.linear_colors()[0].x(), 0.5f, 1e-5f);
  t.material()["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {{"offset", {0.5, 0}}};
  EXPECT_NEAR(t.linear_colors()[0].y(), 1, 1e-5f) << "the green pixel";
  EXPECT_NEAR(t.linear_colors()[1].x(), 0.5f, 1e-5f) << "repeated: the red one";
  t.json["textures"][0]["sampler"] = 0;
  t.json["samplers"] = {{{"wrapS", 33071}}};
  EXPECT_NEAR(t.linear_colors()[1].y(), 1, 1e-5f) << "not repeated";
}

// As many older models are; what stands beside it is for readers that do not know the extension.
TEST(GlbColors, DiffuseColoursStandForBaseColours) {
  TexturedTriangle t;
  Json& material = t.json["materials"][0];
  Json diffuse = {{"diffuseFactor", {0.5, 1, 1, 1}}, {"diffuseTexture", {{"index", 0}}}};
  material = {{"extensions", {{"KHR_materials_pbrSpecularGlossiness", diffuse}}},
              {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 1, 1}}}}};
  t.json["extensionsRequired"] = {"KHR_materials_pbrSpecularGlossiness"};
  const auto colors = t.linear_colors();
  ASSERT_EQ(colors.size(), 3U);
  EXPECT_TRUE(t.read().parsed.has_textures);
  EXPECT_LT((colors[0] - Eigen::Vector3f(0.5f, 0, 0)).norm(), 1e-5f);
  EXPECT_LT((colors[1] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-5f);
  material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {
      {"diffuseFactor", {0.25, 0.5, 1, 1}}};
  EXPECT_LT((t.linear_colors()[2] - Eigen::Vector3f(0.25f, 0.5f, 1)).norm(), 1e-5f);
}

// A quarter turn takes what lay to the right of the corner up from it, where v is less.
TEST(GlbColors, TexturesAreTurnedScaledAndMoved) {
  TexturedTriangle t;
  Json& transform = t.material()["baseColorTexture"]["extensions"]["KHR_texture_transform"];
  transform = {{"rotation", 0.5 * M_PI}};
  auto colors = t.linear_colors();
  EXPECT_LT((colors[0] - Eigen::Vector3f(0, 0, 1)).norm(), 1e-4f) << "(1/4, 1/4) to (1/4, 3/4)";
  EXPECT_LT((colors[1] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-4f) << "(3/4, 1/4) to (1/4, 1/4)";
  transform["offset"] = {0.5, 0};
  EXPECT_LT((t.linear_colors()[1] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-4f) << "(3/4, 1/4)";
  // (3/4, 1/4) times (1, 3) is (3/4, 3/4), turned (3/4, -3/4), moved (5/4, -3/4), a whole less on
  // either side (1/4, 1/4).
  transform["scale"] = {1, 3};
  EXPECT_LT((t.linear_colors()[1] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-4f);
}

// Infinity times a sine of 0 is no number.
TEST(GlbColors, CoordinatesThatTransformToNoNumberAreTheCorner) {
  TexturedTriangle t;
  const float far = 1e30f;
  std::memcpy(t.binary.data() + t.json["bufferViews"][2]["byteOffset"].get<size_t>(), &far, 4);
  t.material()["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {{"scale", {1e300, 1}},
                                                                             {"rotation", 0}};
  EXPECT_LT((t.linear_colors()[0] - Eigen::Vector3f(0.5f, 0.5f, 0.5f)).norm(), 1e-3f)
      << "the mean of all four pixels, which repeat";
}

TEST(GlbColors, TheTransformOfATextureMayNameOtherCoordinates) {
  TexturedTriangle t;
  Json& texture = t.material()["baseColorTexture"];
  texture["texCoord"] = 1;
  texture["extensions"]["KHR_texture_transform"]["texCoord"] = 0;
  EXPECT_LT((t.linear_colors()[0] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-5f);
}

TEST(GlbColors, PicturesMayLieBesideTheFile) {
  TexturedTriangle t;
  const test::TempDir dir;
  const auto& view = t.json["bufferViews"][3];
  test::write_bytes(
      dir / "my wall.png",
      t.binary.substr(view["byteOffset"].get<size_t>(), view["byteLength"].get<size_t>()));
  t.json["images"][0] = {{"uri", "my%20wall.png"}};
  test::write_bytes(dir / "a.glb", t.bytes());
  const GlbMesh mesh = read_glb(dir / "a.glb");
  EXPECT_TRUE(mesh.parsed.has_textures);
  EXPECT_TRUE(mesh.parsed.warnings.empty());
  EXPECT_LT((mesh.parsed.mesh.colors[0] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-5f);
}

TEST(GlbColors, SayWhatHasNoPlaceInColoursOfVertices) {
  TexturedTriangle t;
  t.json["materials"][0]["alphaMode"] = "BLEND";
  t.json["materials"][0]["emissiveFactor"] = {0, 0, 1};
  const auto warnings = t.read().parsed.warnings;
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_NE(warnings[0].find("read as opaque"), std::string::npos);
  EXPECT_NE(warnings[1].find("light that surfaces give off"), std::string::npos);
}

TEST(GlbColors, TexturesThatCannotBeReadAreTold) {
  TexturedTriangle t;
  t.json["images"][0] = {{"uri", "absent.png"}};
  const GlbMesh elsewhere = t.read();
  EXPECT_TRUE(elsewhere.parsed.mesh.colors.empty());
  EXPECT_FALSE(elsewhere.parsed.has_textures);
  ASSERT_EQ(elsewhere.parsed.warnings.size(), 1U);
  EXPECT_TRUE(elsewhere.parsed.warnings[0].starts_with("texture 0 is left out: OPEN"));
  t.json["images"][0] = {{"bufferView", 0}};
  const GlbMesh broken = t.read();
  ASSERT_EQ(broken.parsed.warnings.size(), 1U);
  EXPECT_TRUE(broken.parsed.warnings[0].starts_with("texture 0 is left out: "));
  t.json["textures"][0]["source"] = 7;
  EXPECT_EQ(test::defect_of(t.bytes(), [](const auto& path) { (void)read_glb(path); }), "REF");
}

}  // namespace
}  // namespace cgs::glb_colors_test
