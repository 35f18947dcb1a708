// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb_meshopt.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/glb_reader.h"
#include "io/gltf.h"
#include "libcgs/core/error.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/temp_dir.h"

namespace cgs {
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

TEST(GlbMeshopt, HoldsWhatTheQuantizedFileHoldsInLess) {
  const test::TempDir dir;
  const TriangleMesh mesh = test::labelled_sphere(96, 128);
  const auto written = [&](const char* name, GlbEncoding encoding) {
    return write_glb(dir / name, mesh, test::centimetre_frame(), {.encoding = encoding});
  };
  const GlbReport quantized = written("q.glb", GlbEncoding::Quantized);
  const GlbReport packed = written("m.glb", GlbEncoding::Meshopt);
  EXPECT_LT(packed.bytes, quantized.bytes / 2);
  EXPECT_EQ(packed.measured_max_error, quantized.measured_max_error);
  const GlbMesh a = read_glb(dir / "q.glb");
  const GlbMesh b = read_glb(dir / "m.glb");
  const auto sorted = [](std::vector<Eigen::Vector3d> places) {
    const auto less = [](const Eigen::Vector3d& s, const Eigen::Vector3d& t) {
      return std::lexicographical_compare(s.data(), s.data() + 3, t.data(), t.data() + 3);
    };
    std::sort(places.begin(), places.end(), less);
    return places;
  };
  EXPECT_EQ(sorted(a.parsed.positions), sorted(b.parsed.positions));  // to the last bit
  EXPECT_EQ(a.parsed.mesh.faces.size(), b.parsed.mesh.faces.size());
}

/// Streams of one triangle, decoded with the extension's parameters.
std::string decoded(nlohmann::json parameters, const std::string& stream) {
  const nlohmann::json json = std::move(parameters);
  return meshopt_decoded(JsonValue(json, "a.glb"), stream);
}

TEST(GlbMeshopt, RefusesStreamsThatAreNone) {
  const test::TempDir dir;
  write_glb(dir / "a.glb",
            test::labelled_sphere(),
            test::centimetre_frame(),
            {.encoding = GlbEncoding::Meshopt});
  const std::string file = test::read_bytes(dir / "a.glb");
  const size_t json_size = file.find(std::string("BIN\0", 4)) - 4 - 20;
  const auto document = nlohmann::json::parse(file.substr(20, json_size));
  for (const auto& view : document["bufferViews"]) {
    if (!view.contains("extensions")) continue;
    const nlohmann::json good = view["extensions"][kMeshopt];
    const std::string stream =
        file.substr(28 + json_size + good["byteOffset"].get<size_t>(), good["byteLength"]);
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

}  // namespace
}  // namespace cgs
