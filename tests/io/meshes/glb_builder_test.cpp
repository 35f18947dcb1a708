// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_builder.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/glb_file.h"

namespace cgs::glb_builder_test {
namespace {

using Json = nlohmann::json;

/// A file taken apart by the specification alone.
struct File {
  Json json;
  std::string binary;

  explicit File(const std::string& bytes) {
    uint32_t size = 0;
    std::memcpy(&size, bytes.data() + 12, sizeof size);
    json = Json::parse(bytes.substr(20, size));
    binary = bytes.substr(28 + size);
  }
  const Json& primitive(size_t i) const { return json["meshes"][0]["primitives"][i]; }
  std::string view_bytes(const Json& number) const {
    const Json& view = json["bufferViews"][number.get<size_t>()];
    return binary.substr(view.value("byteOffset", size_t{0}), view["byteLength"]);
  }
};

GlbPrimitive triangle() {
  GlbPrimitive out;
  out.name = "surface";
  out.positions = {{0, 0.1f, 0}, {1, 0, 0}, {0, 2, -1e-20f}};
  out.normals.assign(3, Eigen::Vector3f::UnitZ());
  out.faces = {{2, 0, 1}};
  return out;
}

const Eigen::Vector3d kHere = Eigen::Vector3d::Zero();

std::vector<std::vector<float>> as_rows(const std::vector<float>& values) {
  std::vector<std::vector<float>> out;
  for (const float value : values) out.push_back({value});
  return out;
}

TEST(GlbBuilder, PlainNumbersComeBackBitByBit) {
  GlbPrimitive full = triangle();
  full.name = "observed";
  full.texcoords = {{0, 1}, {0.3f, 0.7f}, {1, 1e-9f}};
  full.colors = {{0, 0.5f, 1}, {0.1f, 0.2f, 0.3f}, {1, 1, 1}};
  full.support = {0, 3, 255};
  full.sigma = {-1, 0.001f, 1e9f};
  full.features = {2, 2, 2};
  GlbBuilder builder({1.5, -2e6, 0.1});
  builder.add_plain(full);
  builder.add_plain(triangle());
  const test::Glb read = test::parse_glb(builder.bytes());
  EXPECT_EQ(read.json["nodes"][0]["translation"], Json({1.5, -2e6, 0.1}));
  ASSERT_EQ(read.parts.size(), 2U);
  EXPECT_EQ(read.parts[0].material, "observed");
  EXPECT_EQ(read.parts[1].material, "surface");
  const auto& values = read.parts[0].values;
  EXPECT_EQ(values.size(), 7U);
  EXPECT_EQ(values.at("_SUPPORT"), as_rows(full.support));
  EXPECT_EQ(values.at("_SIGMA"), as_rows(full.sigma));
  EXPECT_EQ(values.at("_FEATURE_ID_0"), as_rows(full.features));
  EXPECT_EQ(read.parts[1].values.size(), 2U) << "positions and normals";
  for (size_t v = 0; v < 3; ++v) {
    const Eigen::Vector3f& p = full.positions[v];
    const Eigen::Vector3f& c = full.colors[v];
    const Eigen::Vector2f& t = full.texcoords[v];
    EXPECT_EQ(values.at("POSITION")[v], (std::vector<float>{p.x(), p.y(), p.z()}));
    EXPECT_EQ(values.at("NORMAL")[v], (std::vector<float>{0, 0, 1}));
    EXPECT_EQ(values.at("COLOR_0")[v], (std::vector<float>{c.x(), c.y(), c.z()}));
    EXPECT_EQ(values.at("TEXCOORD_0")[v], (std::vector<float>{t.x(), t.y()}));
  }
  for (const test::GlbPart& part : read.parts) EXPECT_EQ(part.faces, triangle().faces);
}

// glTF 2.0, section 3.7.2.1: 65535 of 16 bits restarts a primitive.
TEST(GlbBuilder, IndicesHaveSixteenBitsWhereNoneIsTheirLargest) {
  for (const uint32_t vertices : {3U, 65534U, 65535U, 65536U, 65537U}) {
    GlbPrimitive in = triangle();
    in.positions.resize(vertices, Eigen::Vector3f(0.5f, 0.5f, 0));
    in.normals.resize(vertices, Eigen::Vector3f::UnitZ());
    in.faces.push_back({vertices - 1, 0, 1});
    GlbBuilder builder(kHere);
    builder.add_plain(in);
    const test::Glb read = test::parse_glb(builder.bytes());
    EXPECT_EQ(read.parts.at(0).faces, in.faces) << vertices;
    const size_t number = read.json["meshes"][0]["primitives"][0]["indices"];
    const bool is_short = read.json["accessors"][number]["componentType"] == 5123;
    EXPECT_TRUE(vertices == 65535 || is_short == (vertices < 65535)) << vertices;
  }
}

// The second of three photographs is on no face.
TEST(GlbBuilder, PhotographsKeepTheirBytesAndTheirMaterials) {
  PhotoTexture texture;
  texture.of_face = {0, 2};
  for (const char* name : {"left", "middle", "right"})
    texture.photographs.push_back({name, {}, {}});
  std::vector<TextureImage> images(3);
  images[0].jpeg = "first";
  images[2].jpeg = "the third";
  GlbBuilder builder(kHere);
  builder.add_photographs(texture, images);
  for (const int image : {2, PhotoTexture::kNone, 0}) {
    GlbPrimitive in = triangle();
    in.name = "observed";
    in.image = image;
    builder.add_plain(in);
  }
  const File file(builder.bytes());
  const std::vector<std::string> names = {"observed right", "observed", "observed left"};
  const std::vector<std::string> shown = {"the third", "", "first"};
  for (size_t i = 0; i < 3; ++i) {
    const Json& material = file.json["materials"][file.primitive(i)["material"].get<size_t>()];
    EXPECT_EQ(material["name"], names[i]);
    const Json& pbr = material["pbrMetallicRoughness"];
    ASSERT_EQ(pbr.contains("baseColorTexture"), !shown[i].empty());
    if (shown[i].empty()) continue;
    const Json& used = file.json["textures"][pbr["baseColorTexture"]["index"].get<size_t>()];
    const Json& image = file.json["images"][used["source"].get<size_t>()];
    EXPECT_EQ("observed " + image["name"].get<std::string>(), names[i]);
    EXPECT_EQ(image["mimeType"], "image/jpeg");
    EXPECT_EQ(file.view_bytes(image["bufferView"]), shown[i]);
  }
  EXPECT_EQ(file.json["images"].size(), 2U);
  EXPECT_EQ(file.json["textures"].size(), 2U);
}

// glTF 2.0, section 3.6.2.4: of floats and of what they stand beside.
TEST(GlbBuilder, ViewsBeginAtMultiplesOfFourBytesAndShareNone) {
  PhotoTexture texture;
  texture.of_face = {0};
  texture.photographs.push_back({"a", {}, {}});
  std::vector<TextureImage> images(1);
  images[0].jpeg = "seven b";
  GlbBuilder builder(kHere);
  builder.add_photographs(texture, images);
  builder.add_plain(triangle());  // indices of six bytes
  GlbPrimitive in = triangle();
  in.faces.push_back({0, 1, 2});
  in.faces.push_back({1, 2, 0});
  builder.add_plain(in);
  const File file(builder.bytes());
  size_t end = 0;
  for (const Json& view : file.json["bufferViews"]) {
    const size_t start = view.value("byteOffset", size_t{0});
    EXPECT_EQ(start % 4, 0U);
    EXPECT_GE(start, end);
    EXPECT_LT(start - end, 4U);
    end = start + view["byteLength"].get<size_t>();
  }
  EXPECT_EQ(file.json["bufferViews"].size(), 7U);
  EXPECT_LE(end, file.json["buffers"][0]["byteLength"].get<size_t>());
  EXPECT_LE(file.json["buffers"][0]["byteLength"].get<size_t>(), file.binary.size());
}

TEST(GlbBuilder, WholeNumbersLieOnTheGridFromThePlaceOn) {
  GlbPrimitive in = triangle();
  in.normals.clear();
  QuantizedPrimitive stored;
  stored.positions = {{0, 65535, 9, 0}, {7, 3, 65535, 0}, {1, 4, 8, 0}};
  GlbBuilder builder({10, 20, 30});
  const QuantizedGrid grid{{-1, -2, -3}, 0.25, 16};
  builder.add_quantized(in, stored, grid);
  stored.positions[2] = {300, 500, 400, 0};
  builder.add_quantized(in, stored, grid);
  const File file(builder.bytes());
  const Json& node = file.json["nodes"][0];
  EXPECT_EQ(node["translation"], Json({9, 18, 27}));
  EXPECT_EQ(node["scale"], Json({0.25, 0.25, 0.25}));
  const std::vector<Json> least = {Json({0, 3, 8}), Json({0, 3, 9})};
  const std::vector<Json> most = {Json({7, 65535, 65535}), Json({300, 65535, 65535})};
  for (size_t i = 0; i < 2; ++i) {
    ASSERT_EQ(file.primitive(i)["attributes"].size(), 1U) << "no normals";
    const Json& accessor =
        file.json["accessors"][file.primitive(i)["attributes"]["POSITION"].get<size_t>()];
    EXPECT_EQ(accessor["componentType"], 5123);
    EXPECT_EQ(accessor["count"], 3);
    EXPECT_EQ(accessor["min"], least[i]);
    EXPECT_EQ(accessor["max"], most[i]);
    EXPECT_EQ(file.json["bufferViews"][accessor["bufferView"].get<size_t>()]["byteStride"], 8);
    const std::string bytes = file.view_bytes(accessor["bufferView"]);
    ASSERT_EQ(bytes.size(), 24U);
    uint16_t second = 0;  // y of the first vertex
    std::memcpy(&second, bytes.data() + 2, sizeof second);
    EXPECT_EQ(second, 65535);
  }
  EXPECT_EQ(file.json["extensionsRequired"], Json({"KHR_mesh_quantization"}));
  EXPECT_EQ(file.json["extensionsUsed"], Json({"KHR_mesh_quantization"}));
}

TEST(GlbBuilder, ExtensionsAreNamedOnceHoweverOftenTheyAreUsed) {
  GlbBuilder builder(kHere);
  for (const float number : {0.0f, 2.0f}) {
    GlbPrimitive in = triangle();
    in.is_unlit = true;
    in.features.assign(3, number);
    builder.add_plain(in);
  }
  builder.add_plain(triangle());
  const File file(builder.bytes());
  std::vector<std::string> used = file.json["extensionsUsed"];
  std::sort(used.begin(), used.end());
  EXPECT_EQ(used, (std::vector<std::string>{"EXT_mesh_features", "KHR_materials_unlit"}));
  EXPECT_FALSE(file.json.contains("extensionsRequired")) << "both can be ignored";
  const Json id = {{"featureCount", 1}, {"attribute", 0}, {"label", "provenance"}};
  for (size_t i = 0; i < 3; ++i) {
    const Json& material = file.json["materials"][file.primitive(i)["material"].get<size_t>()];
    EXPECT_EQ(material.contains("extensions"), i < 2);
    ASSERT_EQ(file.primitive(i).contains("extensions"), i < 2);
    if (i == 2) continue;
    EXPECT_EQ(file.primitive(i)["extensions"]["EXT_mesh_features"]["featureIds"],
              Json::array({id}));
    EXPECT_TRUE(file.primitive(i)["attributes"].contains("_FEATURE_ID_0"));
  }
}

TEST(GlbBuilder, ExtrasComeBackAsTheyWere) {
  const Json extras = Json::parse(R"({"a": {"b": [1, -2, 0.1, true, false, "x \" \u00e4", [[3]]]},
      "large": 5000000000, "least": -2147483648, "beyond": 2147483648, "most": 2147483647,
      "tiny": 1e-300, "zero": 0, "empty": ""})");
  GlbBuilder builder(kHere);
  builder.set_extras(extras);
  builder.add_plain(triangle());
  const File file(builder.bytes());
  EXPECT_EQ(file.json["asset"]["extras"], extras);
  EXPECT_EQ(file.json["asset"]["version"], "2.0");
}

}  // namespace
}  // namespace cgs::glb_builder_test
