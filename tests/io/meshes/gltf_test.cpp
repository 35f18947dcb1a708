// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/gltf.h"

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/srgb.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/full_disk.h"
#include "tests/support/glb_file.h"
#include "tests/support/sample_mesh.h"

namespace cgs::gltf_test {
namespace {

using test::Glb;
using test::in_world;
using Part = test::GlbPart;

struct Written {
  GlbReport report;
  Glb glb;
};

Written written(const TriangleMesh& mesh, const Frame& frame, const GlbOptions& options) {
  const test::TempDir dir;
  Written out;
  out.report = write_glb(dir / "a.glb", mesh, frame, options);
  const std::string bytes = test::read_bytes(dir / "a.glb");
  EXPECT_EQ(out.report.bytes, bytes.size());
  out.glb = test::parse_glb(bytes);
  return out;
}

/// Holds a file against the mesh: every face of the class is there, at its place, turned the same
/// way, with the attributes of its corners.
void expect_same(const Glb& glb, const TriangleMesh& mesh, const Frame& frame, double tolerance) {
  for (const Part& part : glb.parts) {
    std::vector<size_t> wanted;
    for (size_t i = 0; i < mesh.faces.size(); ++i) {
      if (provenance_name(mesh.provenance[i]) == part.material) wanted.push_back(i);
    }
    ASSERT_EQ(part.faces.size(), wanted.size()) << part.material;
    // The nearest vertex of the mesh for each vertex of the file, by trying all.
    std::vector<uint32_t> nearest;
    for (size_t i = 0; i < part.values.at("POSITION").size(); ++i) {
      const Eigen::Vector3d p = in_world(glb, part.values.at("POSITION")[i]);
      double best = 1e300;
      uint32_t index = 0;
      for (uint32_t v = 0; v < mesh.vertices.size(); ++v) {
        const double d = (frame.world_from_internal(mesh.vertices[v].cast<double>()) - p).norm();
        if (d < best) index = v;
        best = std::min(best, d);
      }
      EXPECT_LE(best, tolerance);
      nearest.push_back(index);
      EXPECT_EQ(part.values.at("_SUPPORT")[i][0], mesh.support[index]);
      for (int k = 0; k < 3; ++k) {
        constexpr double kHalfPlaceOf11Bits = 0.81;  // [levels of 255], at black
        const double linear = part.values.at("COLOR_0")[i][static_cast<size_t>(k)];
        EXPECT_NEAR(
            255 * srgb_from_linear(float(linear)), 255 * mesh.colors[index][k], kHalfPlaceOf11Bits);
      }
    }
    std::multiset<std::array<uint32_t, 3>> before;
    std::multiset<std::array<uint32_t, 3>> after;
    const auto turned = [](std::array<uint32_t, 3> f) {
      std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
      return f;
    };
    for (const size_t i : wanted) before.insert(turned(mesh.faces[i]));
    for (const auto& f : part.faces) {
      after.insert(turned({nearest[f[0]], nearest[f[1]], nearest[f[2]]}));
    }
    EXPECT_EQ(before, after) << part.material;
  }
}

TEST(WriteGlb, PlainFileHoldsTheMesh) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  const Written out = written(mesh, frame, {.encoding = GlbEncoding::Plain});
  ASSERT_EQ(out.glb.parts.size(), 4u);
  expect_same(out.glb, mesh, frame, 1e-5);
  EXPECT_EQ(out.report.measured_max_error, 0);
  EXPECT_FALSE(out.glb.json.contains("extensionsRequired"));
}

// As KHR_mesh_quantization and the rules for vertex attributes ask for it.
TEST(WriteGlb, QuantizedFileHoldsWholeNumbersOnOneGrid) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere();
  const GlbReport report = write_glb(
      dir / "a.glb", mesh, test::centimetre_frame(), {.encoding = GlbEncoding::Quantized});
  const std::string bytes = test::read_bytes(dir / "a.glb");
  uint32_t json_size = 0;
  std::memcpy(&json_size, bytes.data() + 12, sizeof json_size);
  const auto json = nlohmann::json::parse(bytes.substr(20, json_size));
  const char* const binary = bytes.data() + 28 + json_size;
  EXPECT_EQ(json["extensionsRequired"], nlohmann::json({"KHR_mesh_quantization"}));
  EXPECT_EQ(report.position_bits, 16);
  const auto& node = json["nodes"][0];
  ASSERT_TRUE(node.contains("translation") && node.contains("scale"));
  const double step = node["scale"][0];
  EXPECT_LE(report.measured_max_error, step * std::sqrt(3.0) / 2 * 100 + 1e-9);  // in centimetres
  std::array<int, 3> high = {0, 0, 0};
  for (const auto& primitive : json["meshes"][0]["primitives"]) {
    const auto stored = [&](const char* name, int component, bool normalized, int stride) {
      const auto& accessor = json["accessors"][primitive["attributes"][name].get<size_t>()];
      EXPECT_EQ(accessor["componentType"], component) << name;
      EXPECT_EQ(accessor.value("normalized", false), normalized) << name;
      const auto& view = json["bufferViews"][accessor["bufferView"].get<size_t>()];
      EXPECT_EQ(view["byteStride"], stride) << name;
      EXPECT_EQ(view.value("byteOffset", 0) % 4, 0) << name;
      EXPECT_GE(view["byteLength"].get<size_t>(), accessor["count"].get<size_t>() * size_t(stride));
      return std::pair(accessor, binary + view.value("byteOffset", 0));
    };
    stored("NORMAL", 5120, true, 4);
    stored("COLOR_0", 5123, true, 8);
    const auto [positions, data] = stored("POSITION", 5123, false, 8);
    std::array<int, 3> most = {0, 0, 0};
    for (size_t v = 0; v < positions["count"].get<size_t>(); ++v) {
      for (size_t c = 0; c < 3; ++c) {
        uint16_t value = 0;
        std::memcpy(&value, data + 8 * v + 2 * c, sizeof value);
        most.at(c) = std::max<int>(most.at(c), value);
        high.at(c) = std::max<int>(high.at(c), value);
      }
    }
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(positions["max"][c], most.at(c));
  }
  EXPECT_EQ(std::max({high[0], high[1], high[2]}), 65535);
}

TEST(WriteGlb, DracoTakesSupportAndSigmaBeyondAllBounds) {
  const test::TempDir dir;
  TriangleMesh mesh = test::labelled_sphere();
  mesh.support.front() = std::numeric_limits<float>::max();  // crashed the encoder
  mesh.sigma.front() = std::numeric_limits<float>::max();
  const GlbReport report = write_glb(dir / "a.glb", mesh, test::centimetre_frame());
  EXPECT_EQ(report.triangles, mesh.faces.size());
}

TEST(WriteGlb, DracoFileHoldsTheMeshWithinItsReport) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  const Written out =
      written(mesh, frame, {.y_up = y_up_from(Eigen::Vector3d::UnitZ()), .summary_json = ""});
  ASSERT_EQ(out.glb.parts.size(), 4u);
  EXPECT_GT(out.report.measured_max_error, 0);
  expect_same(out.glb, mesh, frame, out.report.measured_max_error + 1e-5);
  EXPECT_EQ(out.glb.json["extensionsRequired"][0], "KHR_draco_mesh_compression");
  EXPECT_EQ(out.report.triangles, mesh.faces.size());
  EXPECT_EQ(out.report.position_bits, 14);
}

TEST(WriteGlb, KeepsSigmaInMetresAndMarksTheUnknown) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  for (const GlbEncoding encoding : {GlbEncoding::Plain, GlbEncoding::Draco}) {
    const Written out = written(mesh, frame, {.encoding = encoding});
    for (const auto& value : out.glb.parts[0].values.at("_SIGMA")) {
      EXPECT_GT(value[0], 0.001f * 64 * 0.01f * 0.99f);
      EXPECT_LT(value[0], 0.005f * 64 * 0.01f);
    }
    for (const auto& value : out.glb.parts[3].values.at("_SIGMA")) EXPECT_LT(value[0], 0);
  }
}

TEST(WriteGlb, SigmaThatIsKnownStaysSoHoweverSmall) {
  TriangleMesh mesh = test::labelled_sphere();
  for (size_t v = 0; v < mesh.sigma.size(); v += 2) mesh.sigma[v] *= 1e-5f;
  for (const GlbEncoding encoding : {GlbEncoding::Plain, GlbEncoding::Draco}) {
    const Written out = written(mesh, test::centimetre_frame(), {.encoding = encoding});
    for (size_t part = 0; part < 2; ++part) {
      for (const auto& value : out.glb.parts[part].values.at("_SIGMA")) EXPECT_GT(value[0], 0);
    }
  }
}

TEST(WriteGlb, BordersBetweenClassesStayClosed) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Written out = written(mesh, test::centimetre_frame(), {});
  std::set<std::vector<float>> places;
  std::map<std::array<std::vector<float>, 2>, int> edges;
  for (const Part& part : out.glb.parts) {
    const auto& p = part.values.at("POSITION");
    places.insert(p.begin(), p.end());
    for (const auto& f : part.faces) {
      for (size_t k = 0; k < 3; ++k) {
        ++edges[{p[f.at(k)], p[f.at((k + 1) % 3)]}];
        --edges[{p[f.at((k + 1) % 3)], p[f.at(k)]}];
      }
    }
  }
  EXPECT_EQ(places.size(), mesh.vertices.size());
  for (const auto& [edge, balance] : edges) EXPECT_EQ(balance, 0);
}

TEST(WriteGlb, KeepsTheErrorItWasGiven) {
  const TriangleMesh mesh = test::labelled_sphere();
  for (const double wanted : {1.0, 0.1, 1e-2, 1e-3, 1e-4}) {  // of an extent of 51.2
    const Written out = written(mesh, test::centimetre_frame(), {.max_error = wanted});
    EXPECT_LE(out.report.measured_max_error, wanted);
    EXPECT_GT(out.report.measured_max_error, wanted / 8);  // no bits wasted
  }
  const test::TempDir dir;
  EXPECT_THROW(write_glb(dir / "a.glb", mesh, test::centimetre_frame(), {.max_error = 1e-6}),
               InvalidInput);
}

/// Triangles whose stored corners share a place, by trying all.
size_t without_area(const Glb& glb) {
  size_t out = 0;
  for (const Part& part : glb.parts) {
    const auto& p = part.values.at("POSITION");
    for (const auto& [a, b, c] : part.faces) {
      out += p[a] == p[b] || p[b] == p[c] || p[c] == p[a] ? 1 : 0;
    }
  }
  return out;
}

TEST(WriteGlb, CountsTrianglesThatItsGridCannotHold) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Written coarse = written(mesh, test::centimetre_frame(), {.max_error = 10});
  EXPECT_GT(coarse.report.collapsed_triangles, 10u);
  EXPECT_EQ(coarse.report.collapsed_triangles, without_area(coarse.glb));
  EXPECT_EQ(written(mesh, {}, {.max_error = 1e-4}).report.collapsed_triangles, 0u);
}

TEST(WriteGlb, RefusesToWriteNothingButTrianglesWithoutArea) {
  TriangleMesh far_apart;
  for (const float z : {0.0f, 1.0f}) {
    far_apart.vertices.emplace_back(0, 0, z);
    far_apart.vertices.emplace_back(1e-6f, 0, z);
    far_apart.vertices.emplace_back(0, 1e-6f, z);
  }
  far_apart.faces = {{0, 1, 2}, {3, 4, 5}};
  TriangleMesh joined = far_apart;
  joined.vertices.emplace_back(1, 0, 0);
  joined.faces.push_back({0, 3, 6});
  const test::TempDir dir;
  for (const auto& [name, encoding] : glb_encodings()) {
    const bool keeps = encoding == GlbEncoding::Plain;
    const GlbOptions options = {.encoding = encoding};
    const GlbReport report = write_glb(dir / "joined", joined, {}, options);
    EXPECT_EQ(report.triangles, 3u) << name;
    EXPECT_EQ(report.collapsed_triangles, keeps ? 0u : 2u) << name;
    const auto write = [&, file = dir / name] { write_glb(file, far_apart, {}, options); };
    if (keeps) {
      write();
    } else {
      EXPECT_THROW(write(), NumericalError) << name;
    }
    EXPECT_EQ(std::filesystem::exists(dir / name), keeps) << name;
  }
}

TEST(WriteGlb, TellsUnitsOriginAreasAndSummary) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  const Written out =
      written(mesh, frame, {.summary_json = R"({"a": [1, 2.5, "x", true, 5000000000]})"});
  const auto& extras = out.glb.json["asset"]["extras"];
  EXPECT_EQ(extras["units"], "m");
  EXPECT_EQ(extras["metres_per_unit"], 0.01);
  EXPECT_EQ(extras["scale_source"], "known distance");
  EXPECT_EQ(extras["summary"]["a"][1], 2.5);
  EXPECT_EQ(extras["summary"]["a"][4], 5e9);
  const auto area = area_by_provenance(mesh);
  EXPECT_NEAR(extras["area"]["inferred"].get<double>(), area[0] * 0.64 * 0.64, 1e-9);
  EXPECT_NEAR(extras["area"]["observed"].get<double>(), area[2] * 0.64 * 0.64, 1e-9);

  Frame unscaled = frame;
  unscaled.metres_per_unit = 0;
  const Written plain = written(mesh, unscaled, {});
  EXPECT_EQ(plain.glb.json["asset"]["extras"]["units"], "unknown");
  expect_same(plain.glb, mesh, unscaled, plain.report.measured_max_error + 1e-5);
}

TEST(WriteGlb, TakesACenterThatOtherFilesShare) {
  const TriangleMesh mesh = test::labelled_sphere();
  const Frame frame = test::centimetre_frame();
  const Eigen::Vector3d center(0.25, -0.5, 0.125);
  for (const GlbEncoding encoding : {GlbEncoding::Plain, GlbEncoding::Draco}) {
    const Written out = written(mesh, frame, {.encoding = encoding, .center = center});
    const Eigen::Vector3d origin = frame.world_from_internal(center);
    const auto stated = out.glb.json["nodes"][0]["translation"];
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(stated[size_t(k)], 0.01 * origin[k], 1e-9);  // in m
    expect_same(out.glb, mesh, frame, out.report.measured_max_error + 1e-5);
  }
}

TEST(WriteGlb, ShowsInferredSurfaceDifferently) {
  const Written out = written(test::labelled_sphere(), test::centimetre_frame(), {});
  std::set<std::vector<double>> factors;
  for (const auto& material : out.glb.json["materials"]) {
    EXPECT_TRUE(material["doubleSided"]);
    EXPECT_FALSE(material.contains("alphaMode"));  // opaque
    const auto& pbr = material["pbrMetallicRoughness"];
    factors.insert(pbr.value("baseColorFactor", std::vector<double>{1, 1, 1, 1}));
  }
  EXPECT_EQ(factors.size(), 3u);  // seen surface keeps its colours
}

TEST(WriteGlb, WritesBareMeshesAndLeavesOutEmptyClasses) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}, {9, 9, 9}};
  mesh.faces = {{0, 1, 2}, {1, 1, 2}};
  for (const GlbEncoding encoding : {GlbEncoding::Plain, GlbEncoding::Draco}) {
    const Written out = written(mesh, {}, {.encoding = encoding});
    ASSERT_EQ(out.glb.parts.size(), 1u);
    EXPECT_EQ(out.glb.parts[0].material, "surface");
    EXPECT_EQ(out.glb.parts[0].values.size(), 2u);  // position and normal
    EXPECT_EQ(out.report.dropped_triangles, 1u);
    EXPECT_EQ(out.report.vertices, 3u);
  }
}

TEST(WriteGlb, PacksVerticesDenserThanTheGrid) {
  // A ribbon with many vertices to a cell, so that many lie where rounding decides between two
  // cells that both hold others, and of sizes that no decimal number of six places is.
  for (const float length : {8.3128417f, 2.7182818f, 0.0123456789f}) {
    TriangleMesh ribbon;
    constexpr uint32_t kPairs = 20'000;
    for (uint32_t i = 0; i < kPairs; ++i) {
      const float x = length * (float(i) + 0.37f) / float(kPairs);
      ribbon.vertices.emplace_back(x, 0.001f * length, 0.0f);
      ribbon.vertices.emplace_back(x, 0.002f * length, 0.3f * length);
      if (i == 0) continue;
      const uint32_t k = 2 * i;
      ribbon.faces.push_back({k - 2, k, k - 1});
      ribbon.faces.push_back({k - 1, k, k + 1});
    }
    const Written out = written(ribbon, {}, {});
    EXPECT_EQ(out.report.triangles, ribbon.faces.size());
    EXPECT_LE(out.report.measured_max_error, length / 16384 * 1.01);
  }
}

TEST(WriteGlb, WorksAtTheExtremesOfScale) {
  const TriangleMesh mesh = test::labelled_sphere();
  for (const int exponent : {-50, -21, -20, -19, 0, 20, 50}) {
    Frame frame;
    frame.scale = std::ldexp(1.0, exponent);
    frame.origin = Eigen::Vector3d::Constant(frame.scale * 4096);
    frame.file_origin = frame.origin;
    const Written out = written(mesh, frame, {});
    if (out.report.position_bits > 0) {
      EXPECT_NEAR(out.report.measured_max_error / frame.scale, 0.8 / 16384 * 0.8, 0.2 / 16384);
    }
    EXPECT_EQ(out.report.position_bits > 0, exponent > -20);  // too small for Draco
    expect_same(out.glb, mesh, frame, frame.scale * 1e-4);
  }
  const test::TempDir dir;
  Frame enormous;
  enormous.scale = 0x1p80;
  EXPECT_THROW(write_glb(dir / "a.glb", mesh, enormous), InvalidInput);
}

TEST(WriteGlb, GivesEqualBytesForEqualMeshes) {
  const test::TempDir dir;
  write_glb(dir / "a.glb", test::labelled_sphere(), test::centimetre_frame());
  write_glb(dir / "b.glb", test::labelled_sphere(), test::centimetre_frame());
  EXPECT_EQ(test::read_bytes(dir / "a.glb"), test::read_bytes(dir / "b.glb"));
}

TEST(WriteGlb, RefusesWhatItCannotWrite) {
  const test::TempDir dir;
  const auto refused = [&](const TriangleMesh& mesh, const GlbOptions& options) {
    EXPECT_THROW(write_glb(dir / "a.glb", mesh, {}, options), InvalidInput);
  };
  TriangleMesh mesh = test::labelled_sphere();
  refused(mesh, {.max_error = -1});
  refused(mesh, {.max_error = std::nan("")});
  refused(mesh, {.speed = 11});
  refused(mesh, {.speed = -1});
  refused(mesh, {.y_up = 2 * Eigen::Matrix3d::Identity()});
  refused(mesh, {.y_up = -Eigen::Matrix3d::Identity()});
  refused(mesh, {.y_up = Eigen::Matrix3d::Constant(std::nan(""))});
  refused(mesh, {.summary_json = "{"});
  refused({}, {});
  mesh.vertices[4].y() = std::nanf("");
  refused(mesh, {});
  mesh.vertices.assign(mesh.vertices.size(), Eigen::Vector3f::Zero());
  refused(mesh, {});
  EXPECT_EQ(test::entries(dir.path()), 0);
}

TEST(WriteGlb, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_glb(path, test::labelled_sphere(), test::centimetre_frame()); });
}

}  // namespace
}  // namespace cgs::gltf_test
