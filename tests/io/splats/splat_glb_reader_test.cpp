// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_glb_reader.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/bytes/byte_writer.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_reader.h"
#include "io/splats/spz.h"
#include "io/splats/spz_reader.h"
#include "libcgs/core/srgb.h"
#include "libcgs/core/up_axis.h"
#include "libcgs/render/spherical_harmonics.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"

namespace cgs::splat_glb_reader_test {
namespace {

using Json = nlohmann::json;

constexpr int kByte = 5120;
constexpr int kUnsignedByte = 5121;
constexpr int kShort = 5122;
constexpr int kUnsignedShort = 5123;
constexpr int kFloat = 5126;

const std::string kPrefix = "KHR_gaussian_splatting:";

/// A .glb of splats as another program would write it, one buffer view for each attribute.
struct OthersGlb {
  Json json = Json::parse(R"({
      "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_gaussian_splatting"],
      "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": []}],
      "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]})");
  std::string binary;

  /// \return the index of the accessor
  template <typename T>
  size_t accessor(const std::vector<T>& values, const std::string& type, int component) {
    const size_t width = type == "SCALAR" ? 1 : static_cast<size_t>(type[3] - '0');
    const size_t begin = binary.size();
    for (const T value : values) append_bytes(binary, value);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", binary.size() - begin}});
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", component},
                                 {"normalized", component != kFloat},
                                 {"count", values.size() / width},
                                 {"type", type}});
    binary.resize((binary.size() + 3) / 4 * 4);
    json["buffers"][0]["byteLength"] = binary.size();
    return json["accessors"].size() - 1;
  }

  Json& primitive(size_t i = 0) { return json["meshes"][0]["primitives"][i]; }

  /// A primitive of these Gaussians, all attributes as floats.
  void add(const Gaussians& g) {
    const auto floats = [&](size_t width, const auto& value) {
      std::vector<float> out;
      for (size_t i = 0; i < g.size(); ++i) {
        for (size_t k = 0; k < width; ++k) out.push_back(value(i, static_cast<int>(k)));
      }
      return out;
    };
    const auto count = static_cast<size_t>(g.sh_count());
    Json attributes;
    attributes["POSITION"] =
        accessor(floats(3, [&](size_t i, int k) { return g.position[i][k]; }), "VEC3", kFloat);
    attributes[kPrefix + "ROTATION"] = accessor(
        floats(4, [&](size_t i, int k) { return g.rotation[i][(k + 1) % 4]; }), "VEC4", kFloat);
    attributes[kPrefix + "SCALE"] =
        accessor(floats(3, [&](size_t i, int k) { return g.scale[i][k]; }), "VEC3", kFloat);
    attributes[kPrefix + "OPACITY"] = accessor(g.opacity, "SCALAR", kFloat);
    for (int degree = 0, at = 0; degree <= g.sh_degree; ++degree) {
      for (int order = 0; order <= 2 * degree; ++order, ++at) {
        attributes[kPrefix + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" +
                   std::to_string(order)] =
            accessor(floats(3,
                            [&](size_t i, int k) {
                              return g.sh[i * count + static_cast<size_t>(at)][k];
                            }),
                     "VEC3",
                     kFloat);
      }
    }
    json["meshes"][0]["primitives"].push_back(
        {{"mode", 0},
         {"attributes", attributes},
         {"extensions",
          {{"KHR_gaussian_splatting",
            {{"kernel", "ellipse"}, {"colorSpace", "srgb_rec709_display"}}}}}});
  }

  std::string bytes() const {
    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    append_bytes(out, uint32_t{2});
    append_bytes(out, static_cast<uint32_t>(28 + text.size() + binary.size()));
    append_bytes(out, static_cast<uint32_t>(text.size()));
    out += "JSON" + text;
    append_bytes(out, static_cast<uint32_t>(binary.size()));
    return out + std::string("BIN\0", 4) + binary;
  }
  RawSplats read() const { return parse_splat_glb(bytes(), "a.glb"); }
  std::string defect() const {
    return test::defect_of(bytes(), [](const auto& path) { (void)read_splats(path); });
  }
};

OthersGlb others(int count, int degree) {
  OthersGlb out;
  out.add(test::varied_splats(count, degree));
  return out;
}

/// A point of another program's file in the axes of the 3DGS PLY.
Eigen::Vector3d half_turned(const Eigen::Vector3d& p) { return {-p.x(), -p.y(), p.z()}; }

/// Splat i shows and is what the source splat does and is once `linear` has moved it.
void expect_moved(const RawSplats& raw,
                  const Gaussians& g,
                  const Eigen::Matrix3d& linear,
                  const Eigen::Matrix3d& rotation,
                  const Eigen::Vector3d& shift) {
  ASSERT_EQ(raw.size(), g.size());
  ASSERT_EQ(raw.sh_degree, g.sh_degree);
  const size_t count = raw.sh_count();
  const Gaussians directions = test::varied_splats(20, 0);
  for (size_t i = 0; i < g.size(); ++i) {
    const Eigen::Vector3d expected = linear * g.position[i].cast<double>() + shift;
    EXPECT_LT((raw.position[i] - expected).norm(), 1e-6 * (1 + expected.norm())) << i;
    const Eigen::Vector4d q = g.rotation[i].cast<double>();
    const Eigen::Matrix3d axes = linear *
                                 Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().matrix() *
                                 g.scale[i].cast<double>().asDiagonal();
    const Eigen::Matrix3d covariance = axes * axes.transpose();
    EXPECT_LT((test::covariance_of(raw, i) - covariance).norm(), 1e-5 * covariance.norm()) << i;
    EXPECT_NEAR(1 / (1 + std::exp(-raw.logit[i])), g.opacity[i], 1e-6);
    for (const Eigen::Vector3f& p : directions.position) {
      const Eigen::Vector3f d = p.normalized();
      const Eigen::Vector3f there = (rotation * d.cast<double>()).cast<float>();
      const Eigen::Vector3f before = sh_color({g.sh.data() + i * count, count}, g.sh_degree, d);
      const Eigen::Vector3f after =
          sh_color({raw.sh.data() + i * count, count}, g.sh_degree, there);
      EXPECT_LT((after - before).norm(), 1e-5f) << i;
    }
  }
}

const Eigen::Matrix3d kHalfTurn = Eigen::Vector3d(-1, -1, 1).asDiagonal();

TEST(SplatGlbReader, BringsFilesOfOursBackToTheirPlace) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(200, 3);
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 2, -2)}) {
    Frame frame = test::centimetre_frame();
    frame.up = up.normalized();
    write_splat_glb(dir / "a.glb", g, frame, {.y_up = y_up_from(frame.up)});
    const GaussianFile back = read_splats(dir / "a.glb", frame);
    ASSERT_EQ(back.gaussians.size(), g.size());
    EXPECT_TRUE(back.warnings.empty());
    for (size_t i = 0; i < g.size(); ++i) {
      EXPECT_LT((back.gaussians.position[i] - g.position[i]).norm(), 2e-7f);
      EXPECT_LT((back.gaussians.scale[i] - g.scale[i]).norm(), 1e-6f * g.scale[i].norm());
      EXPECT_LT(test::angle_between(back.gaussians.rotation[i], g.rotation[i]), 1e-3);
      EXPECT_NEAR(back.gaussians.opacity[i], g.opacity[i], 1e-6f);
    }
    EXPECT_EQ(back.gaussians.sh, g.sh);  // not turned there and back: the same bits
    const Frame own = read_splats(dir / "a.glb").frame;
    EXPECT_EQ(own.unit_name(), "cm");
    EXPECT_EQ(own.metres_sigma, frame.metres_sigma);
    EXPECT_EQ(own.scale_source, frame.scale_source);
    EXPECT_EQ(own.file_origin, frame.file_origin);
    EXPECT_LT((own.up - frame.up).norm(), 1e-9);
  }
}

TEST(SplatGlbReader, TellsWhatFilesOfOursSayTheyRestOn) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(20, 0);
  write_splat_glb(dir / "a.glb", g, Frame{}, {.evidence = "82 % \"measured\""});
  EXPECT_EQ(read_splats(dir / "a.glb").evidence, "82 % \"measured\"");
  write_splat_glb(dir / "silent.glb", g, Frame{});
  EXPECT_EQ(read_splats(dir / "silent.glb").evidence, "");
  EXPECT_EQ(test::read_bytes(dir / "silent.glb").find("evidence"), std::string::npos);
}

TEST(SplatGlbReader, BringsLabelsBack) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(20, 1);
  write_splat_glb(dir / "a.glb", g, Frame{});
  EXPECT_TRUE(read_splats(dir / "a.glb").gaussians.provenance.empty());
  for (size_t i = 0; i < 20; ++i) g.provenance.push_back(static_cast<Provenance>(i % 6));
  write_splat_glb(dir / "a.glb", g, Frame{});
  const GaussianFile back = read_splats(dir / "a.glb");
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(back.gaussians.provenance, g.provenance);
}

TEST(SplatGlbReader, BringsTagsOfWhatIsMadeUpBack) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(20, 1);
  write_splat_glb(dir / "a.glb", g, Frame{});
  EXPECT_TRUE(read_splats(dir / "a.glb").gaussians.synthetic.empty());
  for (size_t i = 0; i < 20; ++i) g.synthetic.push_back(static_cast<uint8_t>(i % 3));
  g.synthetic_sources = {{"one.png", std::string(64, '1')}, {"two.png", std::string(64, '2')}};
  write_splat_glb(dir / "a.glb", g, Frame{});
  const GaussianFile back = read_splats(dir / "a.glb");
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(back.gaussians.synthetic, g.synthetic);
  EXPECT_EQ(back.gaussians.synthetic_sources, g.synthetic_sources);
}

TEST(SplatGlbReader, PrimitivesWithoutTagsAreNotMadeUp) {
  OthersGlb file = others(3, 0);
  file.add(test::varied_splats(2, 0));
  const size_t index = file.accessor(std::vector<float>{1, 0}, "SCALAR", kFloat);
  file.json["accessors"][index]["normalized"] = false;
  file.primitive(1)["attributes"]["_SYNTHETIC"] = index;
  EXPECT_EQ(file.read().synthetic, (std::vector<float>{0, 0, 0, 1, 0}));
}

TEST(SplatGlbReader, ReadsLabelsOfEveryPrimitiveInWholeNumbersToo) {
  OthersGlb file = others(3, 0);
  file.add(test::varied_splats(2, 0));
  const auto state = [&](size_t primitive, size_t index) {
    file.json["accessors"][index]["normalized"] = false;
    file.primitive(primitive)["attributes"]["_PROVENANCE"] = index;
  };
  state(1, file.accessor(std::vector<float>{5, 2}, "SCALAR", kFloat));
  const RawSplats some = file.read();
  ASSERT_EQ(some.provenance.size(), 5u);
  EXPECT_TRUE(std::isnan(some.provenance[0]) && std::isnan(some.provenance[2]));
  EXPECT_EQ(some.provenance[3], 5);
  const test::TempDir dir;
  test::write_bytes(dir / "a.glb", file.bytes());
  const GaussianFile judged = read_splats(dir / "a.glb");
  EXPECT_TRUE(judged.gaussians.provenance.empty());
  EXPECT_TRUE(
      std::any_of(judged.warnings.begin(), judged.warnings.end(), [](const std::string& warning) {
        return warning.find("3 splats without a label") != std::string::npos;
      }));
  state(0, file.accessor(std::vector<uint8_t>{1, 0, 4}, "SCALAR", kUnsignedByte));
  EXPECT_EQ(file.read().provenance, (std::vector<float>{1, 0, 4, 5, 2}));
  file.primitive(1)["attributes"].erase("_PROVENANCE");
  EXPECT_TRUE(std::isnan(file.read().provenance[4]));
}

TEST(SplatGlbReader, DoesNotTakeWhatOthersNameAlikeForLabels) {
  OthersGlb file = others(2, 0);
  file.primitive()["attributes"]["_PROVENANCE"] =
      file.accessor(std::vector<float>{1, 2, 3, 4}, "VEC2", kFloat);
  EXPECT_TRUE(file.read().provenance.empty());
  EXPECT_TRUE(file.read().notes.empty());
  file.primitive()["attributes"]["_PROVENANCE"] =
      file.accessor(std::vector<float>{1}, "SCALAR", kFloat);
  EXPECT_EQ(file.defect(), "COUNT");
}

TEST(SplatGlbReader, KeepsAnUnknownScaleUnknown) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(20, 0);
  write_splat_glb(dir / "a.glb", g, Frame{});
  EXPECT_FALSE(read_splats(dir / "a.glb").frame.has_metric_scale());
  const Gaussians back = read_splats(dir / "a.glb", Frame{}).gaussians;
  for (size_t i = 0; i < 20; ++i) {
    EXPECT_LT((back.position[i] - g.position[i]).norm(), 1e-7f);
  }
}

TEST(SplatGlbReader, TurnsFilesOfOthersIntoTheAxesOfSplats) {
  for (const int degree : {0, 1, 2, 3}) {
    const RawSplats raw = others(30, degree).read();
    expect_moved(raw, test::varied_splats(30, degree), kHalfTurn, kHalfTurn, {0, 0, 0});
    EXPECT_TRUE(raw.notes.empty());
  }
  const test::TempDir dir;
  test::write_bytes(dir / "a.bin", others(5, 0).bytes());
  const Frame frame = read_splats(dir / "a.bin").frame;
  EXPECT_EQ(frame.unit_name(), "m");
  EXPECT_EQ(frame.up, -Eigen::Vector3d::UnitY());
}

TEST(SplatGlbReader, NodesMoveSplatsAndWhatTheyShow) {
  const Gaussians g = test::varied_splats(30, 3);
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.4, -0.3, 0.8, 0.1).normalized();
  const Json rotation = {q.x(), q.y(), q.z(), q.w()};
  const auto expect =
      [&](const Json& node, const Eigen::Matrix3d& linear, const Eigen::Matrix3d& turn) {
        OthersGlb file = others(30, 3);
        file.json["nodes"][0].update(node);
        expect_moved(file.read(), g, kHalfTurn * linear, kHalfTurn * turn, half_turned({1, 2, 3}));
      };
  const Json at = {1, 2, 3};
  expect({{"translation", at}}, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity());
  expect({{"translation", at}, {"rotation", rotation}, {"scale", {3, 3, 3}}},
         3 * q.matrix(),
         q.matrix());
  expect({{"translation", at}, {"rotation", rotation}, {"scale", {3, 1, 0.5}}},
         q.matrix() * Eigen::Vector3d(3, 1, 0.5).asDiagonal(),
         q.matrix());
  expect({{"translation", at}, {"scale", {-2, 2, 2}}},
         Eigen::Vector3d(-2, 2, 2).asDiagonal(),
         Eigen::Vector3d(-1, 1, 1).asDiagonal());
}

TEST(SplatGlbReader, PutsNodesAndPrimitivesTogether) {
  OthersGlb file = others(3, 1);
  file.add(test::varied_splats(4, 0));
  file.json["nodes"] =
      Json::parse(R"([{"mesh": 0, "children": [1]}, {"mesh": 0, "translation": [0, 10, 0]}])");
  const RawSplats raw = file.read();
  ASSERT_EQ(raw.size(), 14u);
  EXPECT_EQ(raw.sh_degree, 1);
  EXPECT_TRUE(raw.sh[3 * 4 + 1].isZero(0));  // of degree 0 in the file
  EXPECT_LT((raw.position[7] - raw.position[0] - Eigen::Vector3d(0, -10, 0)).norm(), 1e-6);
  file.primitive(1).erase("extensions");
  const RawSplats fewer = file.read();
  EXPECT_EQ(fewer.size(), 6u);
  ASSERT_EQ(fewer.notes.size(), 1u);
  EXPECT_NE(fewer.notes[0].find("left out 1 primitives"), std::string::npos);  // shown twice
}

TEST(SplatGlbReader, TakesWholeNumbersOfEveryType) {
  const auto with = [](const char* name, auto values, const char* type, int component, bool unit) {
    OthersGlb file = others(2, 0);
    const size_t index = file.accessor(values, type, component);
    file.json["accessors"][index]["normalized"] = unit;
    file.primitive()["attributes"][kPrefix + name] = index;
    return file.read();
  };
  using Bytes = std::vector<int8_t>;
  using UnsignedBytes = std::vector<uint8_t>;
  using Shorts = std::vector<int16_t>;
  using UnsignedShorts = std::vector<uint16_t>;
  // A quarter turn around x, and then the half turn around z.
  const Eigen::Vector4f expected = Eigen::Vector4f(0, 0, 1, 1) / std::sqrt(2.0f);
  for (const RawSplats& raw :
       {with("ROTATION", Bytes{90, 0, 0, 90, 0, 0, 0, 127}, "VEC4", kByte, true),
        with("ROTATION", Shorts{23170, 0, 0, 23170, 0, 0, 0, 32767}, "VEC4", kShort, true)}) {
    EXPECT_LT(test::angle_between(raw.rotation[0], expected), 1e-3);
  }
  const auto expect_scale = [](const RawSplats& raw, double first, double second) {
    EXPECT_NEAR(std::exp(raw.log_scale[0].x()), first, 1e-6);
    EXPECT_NEAR(std::exp(raw.log_scale[1].z()), second, 1e-6 * second);
  };
  const UnsignedBytes bytes = {51, 1, 1, 1, 1, 255};
  const UnsignedShorts shorts = {13107, 1, 1, 1, 1, 65535};
  expect_scale(with("SCALE", bytes, "VEC3", kUnsignedByte, true), 0.2, 1);
  expect_scale(with("SCALE", bytes, "VEC3", kUnsignedByte, false), 51, 255);
  expect_scale(with("SCALE", shorts, "VEC3", kUnsignedShort, true), 0.2, 1);
  expect_scale(
      with("SCALE", UnsignedShorts{3, 1, 1, 1, 1, 40000}, "VEC3", kUnsignedShort, false), 3, 40000);
  EXPECT_EQ(with("OPACITY", UnsignedBytes{255, 51}, "SCALAR", kUnsignedByte, true).logit,
            (std::vector<float>{logit_of_byte(255), std::log(0.25f)}));
  const RawSplats fine = with("OPACITY", UnsignedShorts{65535, 0}, "SCALAR", kUnsignedShort, true);
  EXPECT_TRUE(std::isfinite(fine.logit[0]) && std::isfinite(fine.logit[1]));
}

TEST(SplatGlbReader, ReadsScalesOfDraftsAsLogarithms) {
  const Gaussians g = test::varied_splats(20, 0);
  Gaussians draft = g;
  for (Eigen::Vector3f& s : draft.scale) s = s.array().log();
  OthersGlb file;
  file.add(draft);
  const RawSplats raw = file.read();
  expect_moved(raw, g, kHalfTurn, kHalfTurn, {0, 0, 0});
  ASSERT_EQ(raw.notes.size(), 1u);
  EXPECT_NE(raw.notes[0].find("read as logarithms"), std::string::npos);
}

/// What parse_spz() reads, in glTF by an extension of that name.
OthersGlb with_spz(const std::string& blob, const char* name) {
  OthersGlb file;
  file.json["bufferViews"] = {{{"buffer", 0}, {"byteLength", blob.size()}}};
  file.json["buffers"][0]["byteLength"] = blob.size();
  file.binary = blob;
  file.binary.resize((blob.size() + 3) / 4 * 4);
  Json primitive = {{"mode", 0}, {"attributes", Json::object()}};
  Json& splats = primitive["extensions"]["KHR_gaussian_splatting"];
  splats = {{"kernel", "ellipse"}, {"colorSpace", "srgb_rec709_display"}};
  splats["extensions"][name] = {{"bufferView", 0}};
  file.json["meshes"][0]["primitives"] = {primitive};
  file.json["extensionsRequired"] = {"KHR_gaussian_splatting", name};
  return file;
}

// Their blob is packed as left, up, front: the half turn around y of what SPZ alone has, and glTF
// of others is turned half around z when it is read. What remains is a half turn around x, as of
// SPZ files.
TEST(SplatGlbReader, ReadsSplatsCompressedWithSpz) {
  const test::TempDir dir;
  write_spz(dir / "a.spz", test::varied_splats(40, 2), Frame{}, {});
  const std::string blob = test::read_bytes(dir / "a.spz");
  const RawSplats alone = parse_spz(blob, "a.spz");
  for (const char* name :
       {"KHR_gaussian_splatting_compression_spz_2", "KHR_gaussian_splatting_compression_spz"}) {
    OthersGlb file = with_spz(blob, name);
    const RawSplats raw = file.read();
    ASSERT_EQ(raw.size(), 40u);
    EXPECT_TRUE(raw.notes.empty());
    EXPECT_EQ(raw.sh_degree, 2);
    for (size_t i = 0; i < 40; ++i) {
      EXPECT_LT((raw.position[i] - alone.position[i]).norm(), 1e-9);
      EXPECT_LT((raw.log_scale[i] - alone.log_scale[i]).norm(), 1e-5f);
      EXPECT_LT(test::angle_between(raw.rotation[i], alone.rotation[i]), 1e-3);
      EXPECT_EQ(raw.logit[i], alone.logit[i]);
    }
    for (size_t k = 0; k < raw.sh.size(); ++k) EXPECT_LT((raw.sh[k] - alone.sh[k]).norm(), 1e-5f);
    test::write_bytes(dir / "a.glb", file.bytes());
    EXPECT_TRUE(is_splat_glb(dir / "a.glb"));
    EXPECT_EQ(stated_splats(dir / "a.glb")->splats, 40u);
    file.json["nodes"][0]["translation"] = {1, 2, 3};
    EXPECT_LT((file.read().position[0] - alone.position[0] - Eigen::Vector3d(-1, -2, 3)).norm(),
              1e-9);
    file.json["bufferViews"][0]["byteLength"] = blob.size() / 2;
    EXPECT_NE(file.defect(), "OK");
  }
}

// As Cesium ion made them: what is stored are coordinates of glTF.
TEST(SplatGlbReader, ReadsSpzOfADraftInTheAxesOfGltf) {
  const test::TempDir dir;
  write_spz(dir / "a.spz", test::varied_splats(40, 1), Frame{}, {});
  const std::string blob = test::read_bytes(dir / "a.spz");
  const RawSplats alone = parse_spz(blob, "a.spz");  // x, -y, -z of what is stored
  OthersGlb file = with_spz(blob, "KHR_gaussian_splatting_compression_spz_2");
  Json& splats = file.primitive()["extensions"]["KHR_gaussian_splatting"];
  splats.erase("kernel");
  splats.erase("colorSpace");
  const RawSplats raw = file.read();
  ASSERT_EQ(raw.size(), 40u);
  ASSERT_EQ(raw.notes.size(), 1u);
  EXPECT_NE(raw.notes[0].find("its axes are read as those of glTF"), std::string::npos);
  const Eigen::Matrix3d turn = Eigen::Vector3d(-1, 1, -1).asDiagonal();  // a half turn around y
  for (size_t i = 0; i < 40; ++i) {
    EXPECT_LT((raw.position[i] - turn * alone.position[i]).norm(), 1e-9);
    const Eigen::Matrix3d expected = turn * test::covariance_of(alone, i) * turn;
    EXPECT_LT((test::covariance_of(raw, i) - expected).norm(), 1e-5 * expected.norm());
    EXPECT_LT((raw.sh[4 * i + 1] - alone.sh[4 * i + 1]).norm(), 1e-5f) << "along y";
    EXPECT_LT((raw.sh[4 * i + 2] + alone.sh[4 * i + 2]).norm(), 1e-5f) << "along z";
  }
}

TEST(SplatGlbReader, TurnsLinearLightOfSpzIntoSrgb) {
  const test::TempDir dir;
  write_spz(dir / "a.spz", test::varied_splats(20, 0), Frame{}, {});
  OthersGlb file =
      with_spz(test::read_bytes(dir / "a.spz"), "KHR_gaussian_splatting_compression_spz_2");
  const RawSplats stored = file.read();
  Json& splats = file.primitive()["extensions"]["KHR_gaussian_splatting"];
  splats["colorSpace"] = "lin_rec709_display";
  const RawSplats raw = file.read();
  ASSERT_EQ(raw.notes.size(), 1u);
  EXPECT_NE(raw.notes[0].find("linear light"), std::string::npos);
  for (size_t i = 0; i < 20; ++i) {
    for (int k = 0; k < 3; ++k) {
      const float linear = std::clamp(kShC0 * stored.sh[i][k] + 0.5f, 0.0f, 1.0f);
      EXPECT_NEAR(kShC0 * raw.sh[i][k] + 0.5f, srgb_from_linear(linear), 1e-5f);
    }
  }
}

// As of 2024: lengths and rotations of attributes of their own, colour and opacity in COLOR_0.
TEST(SplatGlbReader, ReadsDraftsOfTheExtensionAndText) {
  const test::TempDir dir;
  OthersGlb file;
  const auto add = [&](auto values, const char* type, int component) {
    const size_t out = file.accessor(values, type, component);
    return out;
  };
  Json attributes;
  attributes["POSITION"] = add(std::vector<float>{1, 2, 3}, "VEC3", kFloat);
  attributes["_ROTATION"] = add(std::vector<float>{0, 0, 0, 1}, "VEC4", kFloat);
  attributes["_SCALE"] = add(std::vector<float>{1, 2, 4}, "VEC3", kFloat);
  attributes["COLOR_0"] = add(std::vector<uint8_t>{255, 0, 51, 204}, "VEC4", kUnsignedByte);
  Json primitive = {{"mode", 0}, {"attributes", attributes}};
  primitive["extensions"]["KHR_gaussian_splatting"] = Json::object();
  file.json["meshes"][0]["primitives"] = {primitive};
  file.json["buffers"][0]["uri"] = "a.bin";
  test::write_bytes(dir / "a.bin", file.binary);
  test::write_bytes(dir / "a.gltf", file.json.dump());
  const GaussianFile read = read_splats(dir / "a.gltf");
  ASSERT_EQ(read.gaussians.size(), 1u);
  const Gaussians& g = read.gaussians;
  EXPECT_LT(
      (read.frame.world_from_internal(g.position[0].cast<double>()) - Eigen::Vector3d(-1, -2, 3))
          .norm(),
      1e-5);
  EXPECT_NEAR(g.opacity[0], 0.8f, 1e-5f);
  EXPECT_NEAR(g.scale[0].maxCoeff() * read.frame.scale, 4, 1e-5);
  constexpr float kFirst = 0.28209479f;
  EXPECT_NEAR(g.sh[0].x() * kFirst + 0.5f, 1, 1e-5f);
  EXPECT_NEAR(g.sh[0].z() * kFirst + 0.5f, 0.2f, 1e-5f);
}

/// Harmonics of degree 1 of one splat, 0 but for the one along z.
void add_draft_harmonics(OthersGlb& file, const std::string& prefix) {
  for (int order = 0; order < 3; ++order) {
    const float value = order == 1 ? 0.5f : 0;
    file.primitive()["attributes"][prefix + "SH_DEGREE_1_COEF_" + std::to_string(order)] =
        file.accessor(std::vector<float>{value, 0, -value}, "VEC3", kFloat);
  }
}

// The two that programs wrote in 2025, one with names of its own and one with those of today.
TEST(SplatGlbReader, ReadsColoursAndHarmonicsOfDrafts) {
  for (const std::string& prefix : {std::string("_"), kPrefix}) {
    OthersGlb file;
    Json attributes;
    attributes["POSITION"] = file.accessor(std::vector<float>{1, 2, 3}, "VEC3", kFloat);
    attributes[prefix + "ROTATION"] = file.accessor(std::vector<float>{0, 0, 0, 1}, "VEC4", kFloat);
    attributes[prefix + "SCALE"] = file.accessor(std::vector<float>{1, 2, 4}, "VEC3", kFloat);
    attributes["COLOR_0"] =
        file.accessor(std::vector<uint8_t>{255, 0, 51, 204}, "VEC4", kUnsignedByte);
    Json primitive = {{"mode", 0}, {"attributes", attributes}};
    primitive["extensions"]["KHR_gaussian_splatting"] = Json::object();
    file.json["meshes"][0]["primitives"] = {primitive};
    EXPECT_EQ(file.read().sh_degree, 0) << prefix;
    add_draft_harmonics(file, prefix);
    const RawSplats raw = file.read();
    ASSERT_EQ(raw.size(), 1u) << prefix;
    ASSERT_EQ(raw.sh_degree, 1) << prefix;
    EXPECT_NEAR(1 / (1 + std::exp(-raw.logit[0])), 0.8, 1e-6) << prefix;
    EXPECT_NEAR(raw.sh[0].z() * 0.28209479 + 0.5, 0.2, 1e-5) << prefix;
    // The half turn around z leaves what goes with z as it is.
    EXPECT_LT((raw.sh[2] - Eigen::Vector3f(0.5f, 0, -0.5f)).norm(), 1e-6f) << prefix;
    EXPECT_LT(raw.sh[1].norm() + raw.sh[3].norm(), 1e-6f) << prefix;
    const test::TempDir dir;
    test::write_bytes(dir / "a.glb", file.bytes());
    EXPECT_EQ(stated_splats(dir / "a.glb")->harmonics, 4u) << prefix;
  }
}

TEST(SplatGlbReader, TurnsLinearLightIntoSrgb) {
  OthersGlb file = others(20, 0);
  file.primitive()["extensions"]["KHR_gaussian_splatting"]["colorSpace"] = "lin_rec709_display";
  const RawSplats raw = file.read();
  ASSERT_EQ(raw.notes.size(), 1u);
  const Gaussians g = test::varied_splats(20, 0);
  for (size_t i = 0; i < 20; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double linear = std::clamp(0.28209479 * g.sh[i][k] + 0.5, 0.0, 1.0);
      const double srgb =
          linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
      EXPECT_NEAR(0.28209479 * raw.sh[i][k] + 0.5, srgb, 1e-5);
    }
  }
}

TEST(SplatGlbReader, RefusesWhatIsNoSplat) {
  EXPECT_EQ(others(2, 1).defect(), "OK");
  const auto changed = [](const std::function<void(OthersGlb&)>& change) {
    OthersGlb file = others(2, 1);
    change(file);
    return file.defect();
  };
  const auto attribute = [](const char* name) { return kPrefix + name; };
  EXPECT_EQ(changed([](OthersGlb& f) { f.primitive()["mode"] = 4; }), "SCHEMA");
  EXPECT_EQ(changed([](OthersGlb& f) { f.primitive().erase("mode"); }), "SCHEMA");
  for (const char* gone : {"ROTATION",
                           "SCALE",
                           "OPACITY",
                           "SH_DEGREE_0_COEF_0",
                           "SH_DEGREE_1_COEF_0",
                           "SH_DEGREE_1_COEF_2"}) {
    EXPECT_EQ(changed([&](OthersGlb& f) { f.primitive()["attributes"].erase(attribute(gone)); }),
              "SCHEMA")
        << gone;
  }
  EXPECT_EQ(changed([&](OthersGlb& f) {
              f.primitive()["attributes"][attribute("OPACITY")] =
                  f.accessor(std::vector<float>{0.5f}, "SCALAR", kFloat);
            }),
            "COUNT");
  EXPECT_EQ(changed([](OthersGlb& f) { f.json["accessors"][1]["count"] = 1000; }), "COUNT");
  EXPECT_EQ(changed([](OthersGlb& f) { f.json["nodes"][0]["scale"] = {1, 1, 0}; }), "VALUE");
  EXPECT_EQ(changed([](OthersGlb& f) { f.primitive().erase("extensions"); }), "EMPTY");
  EXPECT_EQ(
      changed([](OthersGlb& f) {
        auto& extension = f.primitive()["extensions"]["KHR_gaussian_splatting"];
        extension["extensions"]["KHR_gaussian_splatting_compression_spz_2"] = {{"bufferView", 0}};
      }),
      "MAGIC")
      << "which comes before the attributes";
}

// A small file whose nodes repeat a mesh more often than memory should hold.
TEST(SplatGlbReader, LimitsWhatNodesRepeat) {
  constexpr size_t kRepeats = 100;
  OthersGlb file = others(1, 0);
  file.json["accessors"][0]["count"] = (1 << 26) / kRepeats + 1;
  file.json["scenes"] = Json::parse(R"([{"nodes": []}])");
  file.json["nodes"] = Json::array();
  for (size_t i = 0; i < kRepeats; ++i) {
    file.json["nodes"].push_back({{"mesh", 0}});
    file.json["scenes"][0]["nodes"].push_back(i);
  }
  EXPECT_EQ(file.defect(), "LIMIT");
}

TEST(SplatGlbReader, IsNotFooledByDamage) {
  const std::string good = others(3, 1).bytes();
  test::expect_every_truncation_is_refused(good, [](const auto& path) { (void)read_splats(path); });
  const test::TempDir dir;
  for (size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ (1 << i % 8));
    test::write_bytes(dir / "b.glb", bad);
    try {
      (void)read_splats(dir / "b.glb");
    } catch (const Error&) {  // any of ours will do
    }
  }
}

TEST(SplatGlbReader, TellsSplatsFromMeshes) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.glb", others(2, 0).bytes());
  EXPECT_TRUE(is_splat_glb(dir / "a.glb"));
  OthersGlb plain = others(2, 0);
  plain.primitive().erase("extensions");
  test::write_bytes(dir / "b.glb", plain.bytes());
  EXPECT_FALSE(is_splat_glb(dir / "b.glb"));
}

}  // namespace
}  // namespace cgs::splat_glb_reader_test
