// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/bytes/byte_writer.h"
#include "io/meshes/gltf.h"
#include "io/meshes/mesh_file.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/triangle_glb.h"

namespace cgs::glb_reader_test {
namespace {

using Json = nlohmann::json;

struct Triangle : test::TriangleGlb {
  GlbMesh read() const {
    const test::TempDir dir;
    test::write_bytes(dir / "a.glb", bytes());
    return read_glb(dir / "a.glb");
  }
};

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_glb(path); });
}

void expect_near(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  EXPECT_LT((a - b).norm(), 1e-12) << a.transpose() << " is not " << b.transpose();
}

TEST(ReadGlb, InterleavedVerticesWithColoursOfBytes) {
  const GlbMesh mesh = Triangle().read();
  ASSERT_EQ(mesh.parsed.positions.size(), 3U);
  expect_near(mesh.parsed.positions[2], {0, 2, 0});
  ASSERT_EQ(mesh.parsed.mesh.faces.size(), 1U);
  ASSERT_EQ(mesh.parsed.mesh.colors.size(), 3U);
  EXPECT_FLOAT_EQ(mesh.parsed.mesh.colors[0].x(), 1);
  // IEC 61966-2-1 of 55 / 255.
  EXPECT_NEAR(mesh.parsed.mesh.colors[0].z(), 1.055 * std::pow(55 / 255.0, 1 / 2.4) - 0.055, 1e-6);
  EXPECT_TRUE(mesh.parsed.mesh.provenance.empty());
  expect_near(mesh.up, {0, 1, 0});
}

TEST(ReadGlb, NodesPlaceTurnScaleAndMirror) {
  Triangle t;
  const double h = std::sqrt(0.5);  // 90 degrees about z
  t.json["nodes"] = {{{"children", {1}}, {"translation", {10, 0, 0}}, {"rotation", {0, 0, h, h}}},
                     {{"mesh", 0}, {"scale", {-1, 3, 1}}}};
  const GlbMesh mesh = t.read();
  expect_near(mesh.parsed.positions[0], {10, 0, 0});
  expect_near(mesh.parsed.positions[1], {10, -1, 0});  // (1,0,0) -> (-1,0,0) -> (0,-1,0)
  expect_near(mesh.parsed.positions[2], {4, 0, 0});    // (0,2,0) -> (0,6,0) -> (-6,0,0)
  const std::array<uint32_t, 3> turned = {0, 2, 1};
  EXPECT_EQ(mesh.parsed.mesh.faces[0], turned);
}

TEST(ReadGlb, AMatrixIsByColumns) {
  Triangle t;
  t.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1};
  expect_near(t.read().parsed.positions[0], {5, 6, 7});
}

TEST(ReadGlb, StripsTurnEverySecondTriangle) {
  Triangle t;
  t.json["meshes"][0]["primitives"][0]["mode"] = 5;
  t.json["accessors"][0]["count"] = 4;
  t.json["bufferViews"][0]["byteLength"] = 8;
  const auto faces = t.read().parsed.mesh.faces;
  ASSERT_EQ(faces.size(), 2U);
  EXPECT_EQ(faces[0], (std::array<uint32_t, 3>{0, 1, 2}));
  EXPECT_EQ(faces[1], (std::array<uint32_t, 3>{1, 0, 2}) /* (1,2,0) turned */)
      << faces[1][0] << faces[1][1] << faces[1][2];
}

TEST(ReadGlb, AFileWithoutScenesShowsItsRoots) {
  Triangle t;
  t.json.erase("scenes");
  t.json["nodes"] = {{{"mesh", 0}}, {{"children", {0}}, {"translation", {5, 0, 0}}}};
  const GlbMesh mesh = t.read();
  ASSERT_EQ(mesh.parsed.mesh.faces.size(), 1U) << "the child is shown once, where its parent is";
  expect_near(mesh.parsed.positions[0], {5, 0, 0});
  t.json["nodes"] = {{{"children", {1}}}, {{"mesh", 0}, {"children", {0}}}};
  EXPECT_EQ(defect(t.bytes()), "EMPTY") << "nodes that are each other's children";
  t.json["nodes"] = {{{"mesh", 0}, {"children", {7}}}};
  EXPECT_EQ(defect(t.bytes()), "REF");
  t.json.erase("nodes");
  EXPECT_EQ(defect(t.bytes()), "EMPTY");
}

TEST(ReadGlb, InstancesAreShownWhereTheyAreListed) {
  Triangle t;
  const size_t at = t.binary.size();
  for (const float c : {0.0f, 0.0f, 0.0f, 10.0f, 0.0f, 0.0f}) append_bytes(t.binary, c);
  for (const float c : {1.0f, 1.0f, 1.0f, 2.0f, 2.0f, 2.0f}) append_bytes(t.binary, c);
  t.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", 48}});
  t.json["buffers"][0]["byteLength"] = t.binary.size();
  for (const size_t offset : {0, 24}) {
    t.json["accessors"].push_back({{"bufferView", 2},
                                   {"byteOffset", offset},
                                   {"componentType", 5126},
                                   {"count", 2},
                                   {"type", "VEC3"}});
  }
  t.json["nodes"][0]["translation"] = {0, 0, 5};
  Json& attributes = t.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes = {{"TRANSLATION", 3}, {"SCALE", 4}};
  const GlbMesh mesh = t.read();
  ASSERT_EQ(mesh.parsed.mesh.faces.size(), 2U);
  expect_near(mesh.parsed.positions[1], {1, 0, 5});
  expect_near(mesh.parsed.positions[4], {12, 0, 5});
  t.json["accessors"][4]["count"] = 1;
  EXPECT_EQ(defect(t.bytes()), "COUNT");
}

// A small file that would fill the memory: 3000 triangles in 12,000 places.
TEST(ReadGlb, RefusesMeshesThatAreShownTooOften) {
  Triangle t;
  const auto add = [&](const std::string& bytes, const Json& accessor) {
    t.binary.resize((t.binary.size() + 3) / 4 * 4);
    t.json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", t.binary.size()}, {"byteLength", bytes.size()}});
    t.binary += bytes;
    t.json["buffers"][0]["byteLength"] = t.binary.size();
    t.json["accessors"].push_back(accessor);
    t.json["accessors"].back()["bufferView"] = t.json["bufferViews"].size() - 1;
    return t.json["accessors"].size() - 1;
  };
  std::string corners;
  for (int i = 0; i < 3000; ++i) corners += std::string("\0\1\2", 3);
  t.json["meshes"][0]["primitives"][0]["indices"] =
      add(corners, {{"componentType", 5121}, {"count", 9000}, {"type", "SCALAR"}});
  const size_t places = add(std::string(size_t{12} * 12'000, '\0'),
                            {{"componentType", 5126}, {"count", 12'000}, {"type", "VEC3"}});
  t.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", places}};
  EXPECT_EQ(defect(t.bytes()), "LIMIT");
  t.json["accessors"][places]["count"] = 2;
  EXPECT_EQ(t.read().parsed.mesh.faces.size(), 6000U);
}

TEST(ReadGlb, PointsBesideTrianglesAddNothing) {
  Triangle t;
  t.json["meshes"][0]["primitives"].push_back({{"mode", 0}, {"attributes", {{"POSITION", 3}}}});
  t.json["accessors"].push_back(t.json["accessors"][1]);
  t.json["accessors"][3]["byteOffset"] = 4;  // (0,0,c), …: other places than the triangle's
  const GlbMesh mesh = t.read();
  EXPECT_EQ(mesh.parsed.positions.size(), 3U);
  EXPECT_EQ(mesh.parsed.mesh.colors.size(), 3U);
  EXPECT_EQ(mesh.parsed.warnings,
            (std::vector<std::string>{"left out 3 points that lie beside the triangles"}));
}

TEST(ReadGlb, RefusesFloatsThatKeepTooLittle) {
  const auto moved = [](float by) {  // along x, and back by the node
    Triangle t;
    const float one = by + 1;
    std::memcpy(t.binary.data() + 8, &by, sizeof by);
    std::memcpy(t.binary.data() + 24, &one, sizeof one);
    std::memcpy(t.binary.data() + 40, &by, sizeof by);
    t.json["nodes"][0]["translation"] = {-by, 0, 0};
    return t;
  };
  EXPECT_EQ(defect(moved(2e6f).bytes()), "VALUE") << "steps of 1/8, the triangle is 2 wide";
  EXPECT_EQ(moved(5e3f).read().parsed.warnings.size(), 1U) << "steps of 1/2048";
  EXPECT_TRUE(moved(100).read().parsed.warnings.empty());
  Triangle t;  // the other way round, nothing is lost
  t.json["nodes"][0]["translation"] = {2e6, 0, 0};
  EXPECT_TRUE(t.read().parsed.warnings.empty());
}

TEST(ReadGlb, LimitsTheSizeOfItsJson) {
  const test::TempDir dir;
  constexpr uint32_t kTooMany = (256u << 20) + 4;
  std::string head = "glTF";
  for (const uint32_t number : {2u, 28 + kTooMany, kTooMany}) append_bytes(head, number);
  test::write_bytes(dir / "a.glb", head + "JSON{}");
  std::filesystem::resize_file(dir / "a.glb", 28 + kTooMany);  // sparse
  EXPECT_THROW((void)read_glb(dir / "a.glb"), LimitError);
}

TEST(ReadGlb, NamesWhatIsWrong) {
  const std::string good = Triangle().bytes();
  const auto broken = [](const char* pointer, const Json& value) {
    Triangle t;
    t.json[Json::json_pointer(pointer)] = value;
    return defect(t.bytes());
  };
  EXPECT_EQ(defect("glTX" + good.substr(4)), "MAGIC");
  EXPECT_EQ(defect(good.substr(0, 4) + '\1' + good.substr(5)), "UNSUPPORTED");
  EXPECT_EQ(defect(good.substr(0, good.size() - 1)), "TRUNCATED");
  EXPECT_EQ(broken("/asset/version", "1.0"), "UNSUPPORTED");
  EXPECT_EQ(broken("/asset/version", 2), "SCHEMA");
  EXPECT_EQ(broken("/asset/minVersion", "2.1"), "UNSUPPORTED");
  EXPECT_EQ(broken("/accessors/1/count", 4), "COUNT");
  EXPECT_EQ(broken("/accessors/1/count", -1), "SCHEMA");
  EXPECT_EQ(broken("/accessors/1/type", "VEC2"), "SCHEMA");
  EXPECT_EQ(broken("/accessors/1/componentType", 5130), "SCHEMA");
  EXPECT_EQ(broken("/accessors/1/sparse", Json::object()), "SCHEMA");
  EXPECT_EQ(broken("/bufferViews/1/byteOffset", 9), "COUNT");
  EXPECT_EQ(broken("/bufferViews/1/byteOffset", 9007199254740992.0), "COUNT");
  EXPECT_EQ(broken("/bufferViews/1/byteStride", 4), "VALUE");
  EXPECT_EQ(broken("/buffers/0/uri", "/etc/passwd"), "PATH");
  EXPECT_EQ(broken("/nodes/0/children", {0}), "REF");
  EXPECT_EQ(broken("/nodes/0/mesh", 1), "REF");
  EXPECT_EQ(broken("/nodes/0/skin", 0), "UNSUPPORTED");
  EXPECT_EQ(broken("/scenes", Json::array()), "EMPTY");
  EXPECT_EQ(broken("/scenes", Json::object()), "SCHEMA");
  EXPECT_EQ(broken("/scene", 1), "REF");
  EXPECT_EQ(broken("/extensionsRequired", {"KHR_meshopt_compression"}), "UNSUPPORTED");
  EXPECT_EQ(broken("/meshes/0/primitives/0/mode", 1), "EMPTY");
  EXPECT_EQ(broken("/meshes/0/primitives/0/mode", 7), "SCHEMA");
  Triangle t;
  t.binary[2] = 3;  // an index
  EXPECT_EQ(defect(t.bytes()), "REF");
}

/// What write_glb() wrote, plain or compressed, read as any mesh.
void expect_round_trip(const GlbOptions& options, double tolerance) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  write_glb(dir / "a.glb", mesh, frame, options);
  const MeasurableFile back = read_mesh_file(dir / "a.glb");
  EXPECT_EQ(back.content.points.size(), mesh.vertices.size());  // welded across materials
  ASSERT_EQ(back.content.mesh.faces.size(), mesh.faces.size());
  EXPECT_DOUBLE_EQ(back.content.frame.metres_per_unit, 0.01);
  EXPECT_DOUBLE_EQ(back.content.frame.metres_sigma, 0.0001);
  EXPECT_EQ(back.content.frame.scale_source, ScaleSource::KnownDistance);
  expect_near(back.content.frame.up, -Eigen::Vector3d::UnitY());
  const double ratio = back.content.frame.scale / frame.scale;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Eigen::Vector3d wanted = frame.world_from_internal(mesh.vertices[v].cast<double>());
    double nearest = 1e300;
    size_t best = 0;
    for (size_t i = 0; i < back.content.points.size(); ++i) {
      const Eigen::Vector3d p = back.content.frame.world_from_internal(back.content.points[i]);
      if ((p - wanted).norm() < nearest) best = i;
      nearest = std::min(nearest, (p - wanted).norm());
    }
    ASSERT_LT(nearest, tolerance);
    EXPECT_LT((back.content.mesh.colors[best] - mesh.colors[v]).norm(), 0.01f);
    EXPECT_FLOAT_EQ(back.content.mesh.support[best], mesh.support[v]);
    if (std::isnan(mesh.sigma[v])) {
      EXPECT_TRUE(std::isnan(back.content.mesh.sigma[best]));
    } else {
      const double stated = mesh.sigma[v];
      EXPECT_NEAR(back.content.mesh.sigma[best] * ratio, stated, 5e-6 + stated / 512);
    }
  }
  const auto before = area_by_provenance(mesh);
  const auto after = area_by_provenance(back.content.mesh);
  for (size_t label = 0; label < before.size(); ++label) {
    EXPECT_NEAR(after.at(label) * ratio * ratio, before.at(label), 1e-3 * before.at(label));
  }
}

TEST(ReadGlb, LeadsOurFilesBackToTheWorld) {
  const Eigen::Matrix3d y_up = y_up_from(-Eigen::Vector3d::UnitY());
  expect_round_trip({.encoding = GlbEncoding::Plain, .y_up = y_up}, 1e-4);
  expect_round_trip({.encoding = GlbEncoding::Quantized, .y_up = y_up}, 64 * 0.8 / 65536);
  expect_round_trip({.encoding = GlbEncoding::Meshopt, .y_up = y_up}, 64 * 0.8 / 8192);
  // Levels of detail share a center; it may lie beside the middle of the mesh.
  const Eigen::Vector3d center(0.25, -0.5, 0.125);
  for (const GlbEncoding encoding : {GlbEncoding::Quantized, GlbEncoding::Meshopt}) {
    const double steps = encoding == GlbEncoding::Meshopt ? 8192 : 32768;
    expect_round_trip({.encoding = encoding, .y_up = y_up, .center = center}, 64 * 0.8 / steps);
  }
  expect_round_trip({.encoding = GlbEncoding::Draco, .y_up = y_up}, 64 * 0.8 / 8192);
}

// One place that is known badly costs the others little, and none becomes surer than it was.
TEST(ReadGlb, SigmaIsNeverLessThanItWas) {
  const test::TempDir dir;
  TriangleMesh mesh = test::labelled_sphere();
  std::fill(mesh.provenance.begin(), mesh.provenance.end(), Provenance::Observed);
  std::fill(mesh.sigma.begin(), mesh.sigma.end(), 0.0004f);
  mesh.sigma[5] = 5;
  for (const auto& [name, encoding] : glb_encodings()) {
    write_glb(dir / "a.glb", mesh, {}, {.encoding = encoding});
    const MeasurableFile back = read_mesh_file(dir / "a.glb");
    const double scale = back.content.frame.scale;
    for (const float s : back.content.mesh.sigma) {
      if (s * scale > 1) continue;
      EXPECT_GT(s * scale, 0.0004 * (1 - 0.004)) << name;
      EXPECT_LT(s * scale, 0.0004 * 1.2) << name;
    }
  }
}

// Programs that pack files for the web join materials that look alike: what one photograph saw
// would become "observed".
TEST(ReadGlb, FeatureNumbersCorrectWhatMaterialsClaim) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  for (const auto& [name, encoding] : glb_encodings()) {
    write_glb(dir / "a.glb", mesh, test::centimetre_frame(), {.encoding = encoding});
    std::string bytes = test::read_bytes(dir / "a.glb");
    const size_t size = bytes.find(std::string("BIN\0", 4)) - 4 - 20;
    nlohmann::json json = nlohmann::json::parse(bytes.substr(20, size));
    for (auto& material : json["materials"]) material["name"] = "observed";
    std::string text = json.dump();
    ASSERT_LE(text.size(), size);  // other names were longer
    text.resize(size, ' ');
    test::write_bytes(dir / "b.glb", bytes.replace(20, size, text));
    const MeasurableFile back = read_mesh_file(dir / "b.glb");
    const double ratio = back.content.frame.scale / test::centimetre_frame().scale;
    const auto before = area_by_provenance(mesh);
    const auto after = area_by_provenance(back.content.mesh);
    for (size_t label = 0; label < before.size(); ++label) {
      EXPECT_NEAR(after.at(label) * ratio * ratio, before.at(label), 1e-3 * before.at(label))
          << name;
    }
  }
}

/// The JSON of a file, changed.
template <typename Change>
void change_json(const std::filesystem::path& path, const Change& change) {
  const std::string bytes = test::read_bytes(path);
  const size_t binary = bytes.find(std::string("BIN\0", 4)) + 4;
  Json json = Json::parse(bytes.substr(20, binary - 8 - 20));
  change(json);
  test::write_bytes(path, test::glb(json.dump(), bytes.substr(binary)));
}

std::vector<std::string> warnings_of_labels(const MeasurableFile& file) {
  std::vector<std::string> out;
  for (const std::string& line : file.warnings) {
    if (line.find("labels") != std::string::npos) out.push_back(line);
  }
  return out;
}

void expect_same_areas(const TriangleMesh& mesh, const MeasurableMesh& back) {
  const auto before = area_by_provenance(mesh);
  const auto after = area_by_provenance(back.mesh);
  const double square = back.frame.scale * back.frame.scale;
  for (size_t label = 0; label < before.size(); ++label) {
    EXPECT_NEAR(after.at(label) * square, before.at(label), 1e-3 * before.at(label)) << label;
  }
}

// Blender keeps names of materials, but neither extras nor attributes of ours.
TEST(ReadGlb, TakesLabelsOfMaterialsWhereExtrasWereLeftOut) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  write_glb(dir / "a.glb", mesh, {}, {.encoding = GlbEncoding::Plain});
  change_json(dir / "a.glb", [](Json& json) {
    json["asset"] = {{"version", "2.0"}, {"generator", "Khronos glTF Blender I/O v4.2.57"}};
    json.erase("extensionsUsed");
    for (Json& primitive : json["meshes"][0]["primitives"]) {
      primitive.erase("extensions");
      for (const char* name : {"_SUPPORT", "_SIGMA", "_FEATURE_ID_0"}) {
        primitive["attributes"].erase(name);
      }
    }
    json["materials"][1]["name"] = "single view.001";
  });
  const MeasurableFile back = read_mesh_file(dir / "a.glb");
  expect_same_areas(mesh, back.content);
  ASSERT_EQ(warnings_of_labels(back).size(), 1U);
  EXPECT_TRUE(warnings_of_labels(back)[0].starts_with("labels are taken from the names"));
  change_json(dir / "a.glb", [](Json& json) { json["materials"][2]["name"] = "roof"; });
  const MeasurableFile some = read_mesh_file(dir / "a.glb");
  EXPECT_TRUE(some.content.mesh.provenance.empty());
  ASSERT_EQ(warnings_of_labels(some).size(), 1U);
  EXPECT_TRUE(warnings_of_labels(some)[0].starts_with("where its faces come from is not known"));
}

// Numbers of features are anybody's; where materials were joined, they tell what had less evidence.
TEST(ReadGlb, FeatureNumbersOfOthersOnlyWeakenNames) {
  const test::TempDir dir;
  TriangleMesh mesh = test::labelled_sphere();
  write_glb(dir / "a.glb", mesh, {}, {.encoding = GlbEncoding::Plain});
  change_json(dir / "a.glb", [](Json& json) {
    json["asset"].erase("extras");
    json["materials"][1]["name"] = "observed";
    json["materials"][2]["name"] = "inferred";
  });
  for (Provenance& label : mesh.provenance) {
    if (label == Provenance::Interpolated) label = Provenance::Inferred;
  }
  expect_same_areas(mesh, read_mesh_file(dir / "a.glb").content);
  change_json(dir / "a.glb", [](Json& json) {  // numbers that are no labels say nothing of them
    for (Json& primitive : json["meshes"][0]["primitives"]) {
      primitive["attributes"]["_FEATURE_ID_0"] = primitive["attributes"]["_SIGMA"];
    }
  });
  for (Provenance& label : mesh.provenance) {
    if (label == Provenance::SingleView) label = Provenance::Observed;
  }
  expect_same_areas(mesh, read_mesh_file(dir / "a.glb").content);
  change_json(dir / "a.glb", [](Json& json) {
    for (Json& material : json["materials"]) material["name"] = "stone";
  });
  const MeasurableFile other = read_mesh_file(dir / "a.glb");
  EXPECT_TRUE(other.content.mesh.provenance.empty());
  EXPECT_TRUE(warnings_of_labels(other).empty());
}

TEST(ReadGlb, SaysThatLabelsOfOursAreLost) {
  const test::TempDir dir;
  write_glb(dir / "a.glb", test::labelled_sphere(), {}, {.encoding = GlbEncoding::Plain});
  EXPECT_TRUE(warnings_of_labels(read_mesh_file(dir / "a.glb")).empty());
  change_json(dir / "a.glb", [](Json& json) {
    json["materials"][0]["name"] = "stone";
    for (Json& primitive : json["meshes"][0]["primitives"]) {
      primitive["attributes"].erase("_FEATURE_ID_0");
    }
  });
  const MeasurableFile back = read_mesh_file(dir / "a.glb");
  EXPECT_TRUE(back.content.mesh.provenance.empty());
  ASSERT_EQ(warnings_of_labels(back).size(), 1U);
  EXPECT_TRUE(
      warnings_of_labels(back)[0].starts_with("where its faces come from is no longer known"));
}

TEST(ReadGlb, AMeshOfOursWithoutLabelsHasNone) {
  const test::TempDir dir;
  TriangleMesh mesh = test::labelled_sphere();
  mesh.provenance.clear();
  write_glb(dir / "a.glb", mesh, test::centimetre_frame());
  const MeasurableFile back = read_mesh_file(dir / "a.glb");
  EXPECT_EQ(back.content.mesh.faces.size(), mesh.faces.size());
  EXPECT_TRUE(back.content.mesh.provenance.empty());
  EXPECT_TRUE(warnings_of_labels(back).empty());
}

TEST(ReadGlb, SurvivesDamagedCompression) {
  const test::TempDir dir;
  write_glb(dir / "a.glb", test::labelled_sphere(), test::centimetre_frame());
  const std::string good = test::read_bytes(dir / "a.glb");
  const size_t binary = good.find(std::string("BIN\0", 4)) + 4;
  int refused = 0;
  constexpr int kTries = 60;
  for (int i = 0; i < kTries; ++i) {
    std::string bad = good;
    const size_t at = binary + (good.size() - binary) * static_cast<size_t>(i) / kTries;
    bad[at] = static_cast<char>(bad[at] ^ (1 << i % 8 | 0x40));
    test::write_bytes(dir / "b.glb", bad);
    try {
      (void)read_glb(dir / "b.glb");
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace cgs::glb_reader_test
