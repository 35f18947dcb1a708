// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_faces.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/meshes/draco_codec.h"
#include "io/meshes/glb_reader.h"
#include "io/meshes/mesh_file.h"
#include "tests/support/full_disk.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/triangle_glb.h"

namespace cgs::glb_faces_test {
namespace {

using Json = nlohmann::json;

/// A box 3 x 2 x 0.5, one accessor after the other. For a test to change.
struct BoxGlb {
  Json json = Json::parse(R"({"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
      "scenes": [{"nodes": [0]}], "meshes": [{"primitives": [{"attributes": {}}]}],
      "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]})");
  std::string binary;

  static std::vector<float> corners() {
    std::vector<float> out;
    for (int i = 0; i < 8; ++i) {
      out.insert(out.end(),
                 {(i & 1) != 0 ? 3.0f : 0, (i & 2) != 0 ? 2.0f : 0, (i & 4) != 0 ? 0.5f : 0});
    }
    return out;
  }

  BoxGlb() {
    primitive()["attributes"]["POSITION"] = accessor(corners(), "VEC3", 5126);
    primitive()["indices"] =
        accessor(std::vector<uint16_t>{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5},
                 "SCALAR",
                 5123);
  }

  Json& primitive() { return json["meshes"][0]["primitives"][0]; }

  template <typename T>
  size_t view(const std::vector<T>& values) {
    binary.resize((binary.size() + 3) / 4 * 4);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", values.size() * sizeof(T)}});
    for (const T value : values) append_bytes(binary, value);
    json["buffers"][0]["byteLength"] = binary.size();
    return json["bufferViews"].size() - 1;
  }

  template <typename T>
  size_t accessor(const std::vector<T>& values, const std::string& type, int component) {
    const size_t width = type == "SCALAR" ? 1 : static_cast<size_t>(type[3] - '0');
    json["accessors"].push_back({{"bufferView", view(values)},
                                 {"componentType", component},
                                 {"count", values.size() / width},
                                 {"type", type}});
    return json["accessors"].size() - 1;
  }

  /// A morph target that lifts the lid by `height`.
  void add_target(float height) {
    std::vector<float> change(24, 0);
    for (size_t i = 4; i < 8; ++i) change[3 * i + 2] = height;
    primitive()["targets"].push_back({{"POSITION", accessor(change, "VEC3", 5126)}});
  }

  std::string bytes() const { return test::glb(json.dump(), binary); }
  GlbMesh read() const { return parse_glb(bytes(), "a.glb"); }
  /// Of the tetrahedra that the faces span with the origin.
  double volume() const {
    const ParsedMesh mesh = read().parsed;
    double out = 0;
    for (const auto& f : mesh.mesh.faces) {
      const Eigen::Vector3d across = mesh.positions[f[1]].cross(mesh.positions[f[2]]);
      out += mesh.positions[f[0]].dot(across) / 6;
    }
    return out;
  }
  std::string defect() const {
    return test::defect_of(bytes(), [](const auto& path) { (void)read_glb(path); });
  }
};

TEST(GlbFaces, MorphTargetsCountByTheirDefaultWeights) {
  BoxGlb t;
  EXPECT_NEAR(t.volume(), 3, 1e-6);
  t.add_target(1);
  t.add_target(10);
  EXPECT_NEAR(t.volume(), 3, 1e-6) << "without weights: 0";
  t.json["meshes"][0]["weights"] = {1, 0};
  EXPECT_NEAR(t.volume(), 3 * 2 * 1.5, 1e-5);
  t.json["meshes"][0]["weights"] = {0.5, 0.25};
  EXPECT_NEAR(t.volume(), 3 * 2 * (0.5 + 0.5 + 2.5), 1e-5);
  t.json["nodes"][0]["weights"] = {0, 1};
  EXPECT_NEAR(t.volume(), 3 * 2 * 10.5, 1e-4) << "the node's come first";
  t.json["nodes"][0]["weights"] = {0};
  EXPECT_EQ(t.defect(), "COUNT");
}

TEST(GlbFaces, EveryNodeHasWeightsOfItsOwn) {
  BoxGlb t;
  t.add_target(1);
  t.json["nodes"] = {{{"mesh", 0}, {"weights", {1}}},
                     {{"mesh", 0}, {"weights", {-0.25}}, {"translation", {10, 0, 0}}}};
  t.json["scenes"][0]["nodes"] = {0, 1};
  EXPECT_NEAR(t.volume(), 3 * 2 * (1.5 + 0.25), 1e-5);
}

TEST(GlbFaces, MorphTargetsChangeColoursToo) {
  BoxGlb t;
  t.primitive()["attributes"]["COLOR_0"] = t.accessor(std::vector<float>(24, 0.25f), "VEC3", 5126);
  t.primitive()["targets"] = {
      {{"COLOR_0", t.accessor(std::vector<float>(24, 0.5f), "VEC3", 5126)}}};
  t.json["meshes"][0]["weights"] = {0.5};
  // 1/4 + 1/2 * 1/2 in linear light; IEC 61966-2-1.
  EXPECT_NEAR(t.read().parsed.mesh.colors[0].x(), 1.055 * std::pow(0.5, 1 / 2.4) - 0.055, 1e-5);
}

TEST(GlbFaces, SparseAccessorsReplaceZerosOrWhatIsStored) {
  BoxGlb t;
  // All corners but the first, which is (0, 0, 0).
  std::vector<float> values;
  for (int i = 1; i < 8; ++i) {
    values.insert(values.end(),
                  {(i & 1) != 0 ? 3.0f : 0, (i & 2) != 0 ? 2.0f : 0, (i & 4) != 0 ? 0.5f : 0});
  }
  const size_t at = t.view(std::vector<uint8_t>{1, 2, 3, 4, 5, 6, 7});
  const size_t with = t.view(values);
  const Json sparse = {{"count", 7},
                       {"indices", {{"bufferView", at}, {"componentType", 5121}}},
                       {"values", {{"bufferView", with}}}};
  t.json["accessors"].push_back(
      {{"componentType", 5126}, {"count", 8}, {"type", "VEC3"}, {"sparse", sparse}});
  t.primitive()["attributes"]["POSITION"] = 2;
  EXPECT_NEAR(t.volume(), 3, 1e-6);
  // Of the stored box, one corner and then nothing else: the same but for its height.
  t.json["accessors"][2]["bufferView"] = 0;
  for (size_t i = 0; i < 7; ++i) values[3 * i + 2] *= 2;
  t.json["accessors"][2]["sparse"]["values"]["bufferView"] = t.view(values);
  EXPECT_NEAR(t.volume(), 6, 1e-5);
  t.json["accessors"][2]["count"] = 7;
  EXPECT_EQ(t.defect(), "REF") << "index 7 of 7";
  t.json["accessors"][2]["sparse"]["count"] = 8;
  EXPECT_EQ(t.defect(), "COUNT");
}

TEST(GlbFaces, AnAccessorWithoutABufferViewHoldsZeros) {
  BoxGlb t;
  t.json["accessors"].push_back({{"componentType", 5126}, {"count", 8}, {"type", "VEC3"}});
  t.primitive()["attributes"]["COLOR_0"] = 2;
  EXPECT_EQ(t.read().parsed.mesh.colors[0], Eigen::Vector3f(0, 0, 0));
  t.json["accessors"][2]["count"] = 1'000'000'000'000;
  EXPECT_EQ(t.defect(), "COUNT") << "nothing is allocated for what no file holds";
}

TEST(GlbFaces, AFileOfPointsAloneIsACloud) {
  BoxGlb t;
  t.primitive()["mode"] = 0;
  t.primitive().erase("indices");
  t.primitive()["attributes"]["NORMAL"] =
      t.accessor(std::vector<float>{0, 0, -1, 0, 0, -1, 0, 0, -1, 0, 0, -1,
                                    0, 0, 1,  0, 0, 1,  0, 0, 1,  0, 0, 1},
                 "VEC3",
                 5126);
  const double h = std::sqrt(0.5);  // a quarter turn about x: z to -y
  t.json["nodes"][0]["rotation"] = {h, 0, 0, h};
  t.json["nodes"][0]["translation"] = {0, 0, 7};
  const MeasurableFile file = parse_glb_file(t.bytes(), "a.glb");
  ASSERT_EQ(file.content.points.size(), 8U);
  EXPECT_TRUE(file.content.mesh.faces.empty());
  EXPECT_TRUE(file.warnings.empty());
  const auto place = [&](size_t i) {
    return file.content.file_from_internal(file.content.points[i]);
  };
  EXPECT_LT((place(7) - Eigen::Vector3d(3, -0.5, 9)).norm(), 1e-6);
  EXPECT_LT((file.content.mesh.normals[7] - Eigen::Vector3f(0, -1, 0)).norm(), 1e-6f);
}

// Programs that paint or measure a mesh add arrays of their own beside what was compressed.
TEST(GlbFaces, AttributesBesideACompressedMeshAreReadToo) {
  BoxGlb t;
  GlbPrimitive box;
  const std::vector<float> corners = BoxGlb::corners();
  for (size_t i = 0; i < 8; ++i) {
    box.positions.emplace_back(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
  }
  box.faces = test::cube_mesh().mesh.faces;
  const DracoPrimitive packed = draco_compress(box, {Eigen::Vector3f::Zero(), 4, 14}, 5);
  t.primitive()["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", t.view(std::vector<char>(packed.bytes.begin(), packed.bytes.end()))},
      {"attributes", packed.attribute_ids}};
  EXPECT_NEAR(t.volume(), 3, 1e-2);
  const size_t n = packed.vertices;
  t.primitive()["attributes"]["COLOR_0"] = t.accessor(std::vector<float>(3 * n, 1), "VEC3", 5126);
  t.primitive()["attributes"]["_SUPPORT"] = t.accessor(std::vector<float>(n, 7), "SCALAR", 5126);
  const ParsedMesh mesh = t.read().parsed;
  ASSERT_FALSE(mesh.mesh.colors.empty());
  EXPECT_EQ(mesh.mesh.support, std::vector<float>(mesh.positions.size(), 7));
  t.primitive()["attributes"]["_SUPPORT"] = t.accessor(std::vector<float>{7}, "SCALAR", 5126);
  EXPECT_EQ(t.defect(), "COUNT");
}

// As clouds of depth cameras have them; two points in one place are two.
TEST(GlbFaces, PointsThatAreNoNumbersAreCounted) {
  BoxGlb t;
  t.primitive()["mode"] = 0;
  t.primitive()["attributes"]["POSITION"] =
      t.accessor(std::vector<float>{1, 2, 3, NAN, 0, 0, 1, 2, 3, 4, 5, 6}, "VEC3", 5126);
  t.primitive().erase("indices");
  const GlbMesh mesh = t.read();
  EXPECT_EQ(mesh.parsed.positions.size(), 3U);
  ASSERT_EQ(mesh.parsed.warnings.size(), 1U);
  EXPECT_EQ(mesh.parsed.warnings[0], "dropped 1 vertex of 4 that is not finite");
}

// Faces of the box about its corner 7: 5 7 6, 3 6 7 and 3 7 5.
TEST(GlbFaces, AVertexThatIsNoNumberGoesWithItsFaces) {
  for (const float bad : {NAN, INFINITY, -INFINITY}) {
    BoxGlb t;
    std::vector<float> corners = BoxGlb::corners();
    corners[3 * 7 + 2] = bad;
    t.primitive()["attributes"]["POSITION"] = t.accessor(corners, "VEC3", 5126);
    const GlbMesh mesh = t.read();
    EXPECT_EQ(mesh.parsed.positions.size(), 7U);
    EXPECT_EQ(mesh.parsed.mesh.faces.size(), 9U);
    ASSERT_EQ(mesh.parsed.warnings.size(), 1U);
    EXPECT_EQ(mesh.parsed.warnings[0],
              "dropped 1 vertex of 8 that is not finite, and 3 faces there");
    for (const size_t v : {1, 2, 4}) corners[3 * v] = bad;
    t.primitive()["attributes"]["POSITION"] = t.accessor(corners, "VEC3", 5126);
    EXPECT_EQ(t.defect(), "VALUE");
  }
}

// What had triangles is no cloud when all of them vanish.
TEST(GlbFaces, FlattenedTrianglesLeaveNoCloud) {
  BoxGlb t;
  t.json["nodes"][0]["scale"] = {0, 0, 0};
  EXPECT_EQ(t.defect(), "EMPTY");
}

TEST(GlbFaces, LinesAreCounted) {
  BoxGlb t;
  const auto with = [&](int mode) {
    t.json["meshes"][0]["primitives"][1] = t.primitive();
    t.json["meshes"][0]["primitives"][1]["mode"] = mode;
    const auto warnings = t.read().parsed.warnings;
    return warnings.size() == 1 ? warnings[0] : std::to_string(warnings.size());
  };
  EXPECT_EQ(with(1), "left out 18 line segments");  // of 36 indices
  EXPECT_EQ(with(2), "left out 36 line segments");
  EXPECT_EQ(with(3), "left out 35 line segments");
  t.primitive()["mode"] = 2;
  t.json["meshes"][0]["primitives"].erase(1);
  EXPECT_EQ(t.defect(), "EMPTY");
}

TEST(GlbFaces, ACornerNamedTwiceLeadsFromStripToStrip) {
  BoxGlb t;
  t.primitive()["mode"] = 5;
  // Two quads, of the bottom and of the lid: 0 1 2 3, then by 3 4 to 4 5 6 7.
  t.primitive()["indices"] =
      t.accessor(std::vector<uint8_t>{0, 1, 2, 3, 3, 4, 4, 5, 6, 7}, "SCALAR", 5121);
  const GlbMesh mesh = t.read();
  ASSERT_EQ(mesh.parsed.mesh.faces.size(), 4U);
  EXPECT_TRUE(mesh.parsed.warnings.empty());
  EXPECT_EQ(mesh.parsed.mesh.faces[2], (std::array<uint32_t, 3>{4, 5, 6}));
  EXPECT_EQ(mesh.parsed.mesh.faces[3], (std::array<uint32_t, 3>{5, 7, 6}));
}

}  // namespace
}  // namespace cgs::glb_faces_test
