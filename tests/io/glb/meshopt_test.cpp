// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/meshopt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/glb/bytes.h"
#include "io/meshes/glb_reader.h"
#include "io/meshes/gltf.h"
#include "libcgs/core/error.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/temp_dir.h"

namespace cgs::glb_meshopt_test {
namespace {

using Corners = std::array<std::array<float, 3>, 3>;

/// Faces by the places of their corners, each beginning with its smallest.
std::multiset<Corners> faces_by_place(const GlbPrimitive& primitive) {
  std::multiset<Corners> out;
  for (const auto& face : primitive.faces) {
    Corners corners;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = primitive.positions[face.at(k)];
      corners.at(k) = {p.x(), p.y(), p.z()};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    out.insert(corners);
  }
  return out;
}

TEST(GlbMeshopt, CacheOrderIsTheSameMesh) {
  for (const GlbPrimitive& in : glb_primitives(test::labelled_sphere(), {})) {
    const GlbPrimitive out = in_cache_order(in);
    EXPECT_EQ(faces_by_place(out), faces_by_place(in));
    ASSERT_EQ(out.positions.size(), in.positions.size());
    // Attributes went with their places.
    std::set<std::array<float, 3>> before;
    std::set<std::array<float, 3>> after;
    for (size_t v = 0; v < in.positions.size(); ++v) {
      before.insert({in.positions[v].x(), in.sigma[v], in.colors[v].y()});
      after.insert({out.positions[v].x(), out.sigma[v], out.colors[v].y()});
    }
    EXPECT_EQ(before, after);
  }
}

/// What a file says of a face, corners from the smallest place on.
struct FaceClaims {
  std::array<std::array<double, 3>, 3> places;
  std::array<float, 3> support;
  std::array<float, 3> sigma;
  Provenance label;

  bool operator<(const FaceClaims& other) const { return places < other.places; }
};

FaceClaims claims_of(const GlbMesh& file, size_t f) {
  const TriangleMesh& mesh = file.parsed.mesh;
  auto face = mesh.faces[f];
  const auto place = [&](uint32_t v) {
    const Eigen::Vector3d& p = file.parsed.positions[v];
    return std::array{p.x(), p.y(), p.z()};
  };
  const auto less = [&](uint32_t a, uint32_t b) { return place(a) < place(b); };
  std::rotate(face.begin(), std::min_element(face.begin(), face.end(), less), face.end());
  FaceClaims out{{}, {}, {}, mesh.provenance[f]};
  for (size_t k = 0; k < 3; ++k) {
    out.places.at(k) = place(face.at(k));
    out.support.at(k) = mesh.support[face.at(k)];
    out.sigma.at(k) = mesh.sigma[face.at(k)];
  }
  return out;
}

TEST(GlbMeshopt, HoldsWhatTheQuantizedFileHoldsInLess) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere(96, 128);
  const auto written = [&](const char* name, GlbEncoding encoding) {
    return write_glb(dir / name,
                     mesh,
                     test::centimetre_frame(),
                     {.encoding = encoding, .max_error = 0.9 * 51.2 / 65535});  // all 16 bits
  };
  const GlbReport quantized = written("q.glb", GlbEncoding::Quantized);
  const GlbReport packed = written("m.glb", GlbEncoding::Meshopt);
  EXPECT_LT(packed.bytes, quantized.bytes / 2);
  EXPECT_EQ(packed.measured_max_error, quantized.measured_max_error);
  // To the last bit, but for sigma, which keeps 9.
  const auto claims = [&](const char* name) {
    const GlbMesh file = read_glb(dir / name);
    std::multiset<FaceClaims> out;
    for (size_t f = 0; f < file.parsed.mesh.faces.size(); ++f) out.insert(claims_of(file, f));
    return out;
  };
  const std::multiset<FaceClaims> wanted = claims("q.glb");
  const std::multiset<FaceClaims> found = claims("m.glb");
  ASSERT_EQ(found.size(), wanted.size());
  for (auto a = found.begin(), b = wanted.begin(); a != found.end(); ++a, ++b) {
    EXPECT_EQ(a->places, b->places);
    EXPECT_EQ(a->label, b->label);
    EXPECT_EQ(a->support, b->support);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(a->sigma.at(k), b->sigma.at(k), std::abs(b->sigma.at(k)) / (1 << 7));
    }
  }
}

TEST(GlbMeshopt, StoresPositionsNoFinerThanAsked) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere(96, 128);
  size_t previous = 0;
  for (const double wanted : {1.0, 0.1, 1e-2, 1e-3}) {  // of an extent of 51.2
    const GlbReport out = write_glb(dir / "a.glb",
                                    mesh,
                                    test::centimetre_frame(),
                                    {.encoding = GlbEncoding::Meshopt, .max_error = wanted});
    EXPECT_LE(out.measured_max_error, wanted);
    EXPECT_GT(out.measured_max_error, wanted / 8);
    EXPECT_GT(out.bytes, previous);
    previous = out.bytes;
  }
  const GlbReport by_default =
      write_glb(dir / "a.glb", mesh, test::centimetre_frame(), {.encoding = GlbEncoding::Meshopt});
  EXPECT_EQ(by_default.position_bits, 14);
}

/// A file, taken apart.
struct PackedSphere {
  nlohmann::json document;
  std::string binary;
};

PackedSphere packed_sphere() {
  const test::TempDir dir;
  write_glb(dir / "a.glb",
            test::labelled_sphere(),
            test::centimetre_frame(),
            {.encoding = GlbEncoding::Meshopt});
  const std::string file = test::read_bytes(dir / "a.glb");
  const size_t json_size = file.find(std::string("BIN\0", 4)) - 4 - 20;
  return {nlohmann::json::parse(file.substr(20, json_size)), file.substr(28 + json_size)};
}

/// A stream decoded with the extension's parameters.
std::string decoded(nlohmann::json parameters, const std::string& stream) {
  const nlohmann::json json = std::move(parameters);
  return meshopt_decoded(JsonValue(json, "a.glb"), stream);
}

TEST(GlbMeshopt, RefusesStreamsThatAreNone) {
  const PackedSphere file = packed_sphere();
  for (const auto& view : file.document["bufferViews"]) {
    if (!view.contains("extensions")) continue;
    const nlohmann::json good = view["extensions"][kMeshopt];
    const std::string stream =
        file.binary.substr(good["byteOffset"].get<size_t>(), good["byteLength"]);
    EXPECT_EQ(decoded(good, stream).size(), view["byteLength"]);
    EXPECT_THROW(decoded(good, stream.substr(0, stream.size() - 1)), BadInput);
    EXPECT_THROW(decoded(good, ""), BadInput);
    EXPECT_THROW(decoded(good, std::string(stream.size(), '\0')), BadInput);
    const auto changed = [&](const char* key, const nlohmann::json& value) {
      nlohmann::json bad = good;
      bad[key] = value;
      return bad;
    };
    EXPECT_THROW(decoded(changed("count", 3'000'000'000u), stream), BadInput);
    EXPECT_THROW(decoded(changed("count", -3), stream), BadInput);
    EXPECT_THROW(decoded(changed("byteStride", 0), stream), BadInput);
    EXPECT_THROW(decoded(changed("byteStride", 3), stream), BadInput);
    EXPECT_THROW(decoded(changed("byteStride", 1024), stream), BadInput);
    EXPECT_THROW(decoded(changed("mode", "STRIPS"), stream), BadInput);
    EXPECT_THROW(decoded(changed("filter", "COLOR"), stream), BadInput);
  }
}

// A small file with many views of one stream would fill the memory.
TEST(GlbMeshopt, RefusesManyViewsOfOneStream) {
  const test::TempDir dir;
  PackedSphere file = packed_sphere();
  nlohmann::json& views = file.document["bufferViews"];
  const nlohmann::json view = views[0];
  ASSERT_TRUE(view.contains("extensions"));
  constexpr int kCopies = 2000;
  for (int i = 0; i < kCopies; ++i) views.push_back(view);
  test::write_bytes(dir / "b.glb", glb_bytes(file.document.dump(), file.binary));
  EXPECT_THROW(read_glb(dir / "b.glb"), LimitError);
}

}  // namespace
}  // namespace cgs::glb_meshopt_test
