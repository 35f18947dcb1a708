// SPDX-License-Identifier: GPL-3.0-or-later
//
// Coarser levels of asset.glb and their tileset.json, on a small portal capture. The tileset is
// followed as 3D Tiles 1.1 says a viewer does it; distances are measured by trying every triangle.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/image.h"
#include "tests/support/largest.h"
#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"
#include "tests/support/triangles.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::run_cgs;
using test::TempDir;

constexpr double kMetresPerFoot = 0.3048;

std::string run_arguments(const fs::path& capture, const TempDir& dir, const std::string& more) {
  return "run " + capture.string() +
         " --views view_01,view_02,view_03 --assume-unit ft --set steps=0 -q -o " +
         (dir / "out").string() + " " + more;
}
std::string run_arguments(const TempDir& dir, const std::string& more) {
  return run_arguments(dir / "capture", dir, more);
}

/// A run with levels, for the tests that change nothing in it.
struct LevelsRun {
  TempDir dir;
  test::ProgramResult result;

  LevelsRun() {
    test::copy_portal_capture(dir / "capture", 3);
    result = run_cgs(run_arguments(dir, "--lods 2 --json --voxel-size 0.08"));
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  /// Arguments of one that goes on from a copy of it in another folder.
  std::string arguments_from_copy(const TempDir& other, const std::string& more) const {
    fs::copy(dir / "out", other / "out", fs::copy_options::recursive);
    return run_arguments(dir / "capture", other, "-w --voxel-size 0.08 " + more);
  }
};

const LevelsRun& levels_run() {
  static const LevelsRun kRun;
  return kRun;
}

json parsed(const fs::path& path) { return json::parse(test::read_bytes(path)); }

std::map<std::string, std::string> web_files(const TempDir& dir) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::directory_iterator(dir / "out/web")) {
    if (entry.is_directory()) continue;  // pictures of filled holes
    out[entry.path().filename().string()] = test::read_bytes(entry.path());
  }
  return out;
}

std::set<std::string> names_of(const std::map<std::string, std::string>& files) {
  std::set<std::string> out;
  for (const auto& [name, bytes] : files) out.insert(name);
  return out;
}

/// A tile with the transform of its ancestors.
struct Tile {
  json object;
  Eigen::Matrix4d tileset_from_tile;
};

// From the root down; every tile has one child at most.
std::vector<Tile> tiles_of(const json& tileset) {
  std::vector<Tile> out;
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  for (const json* tile = &tileset.at("root");; tile = &tile->at("children").at(0)) {
    if (tile->contains("transform")) {
      const auto columns = tile->at("transform").get<std::vector<double>>();
      EXPECT_EQ(columns.size(), 16u);
      transform = transform * Eigen::Map<const Eigen::Matrix4d>(columns.data());
    }
    out.push_back({*tile, transform});
    if (!tile->contains("children")) return out;
    EXPECT_EQ(tile->at("children").size(), 1u);
  }
}

// Content has +Y up, tiles have +Z up.
Eigen::Vector3d in_tile(const test::Glb& glb, const std::vector<float>& position) {
  const Eigen::Vector3d p = test::placed(glb, position);
  return {p.x(), -p.z(), p.y()};
}

// How far outside of a box a place lies, as a share of the half length that it is outside along.
double reach(const json& box, const Eigen::Vector3d& place) {
  const auto values = box.get<std::vector<double>>();
  const auto at = [&](size_t i) { return Eigen::Map<const Eigen::Vector3d>(&values[i]); };
  double out = 0;
  for (const size_t axis : {3, 6, 9}) {
    out = test::largest(out, std::abs((place - at(0)).dot(at(axis))) / at(axis).squaredNorm());
  }
  return out;
}

void expect_placed(const Tile& tile, const test::Glb& glb) {
  const json& extras = glb.json["asset"]["extras"];
  const auto axes = extras["gltf_from_world"].get<std::vector<double>>();  // row by row
  const auto world = [&](size_t row, const Eigen::Vector3d& p) {
    return kMetresPerFoot *
           (axes[3 * row] * p.x() + axes[3 * row + 1] * p.y() + axes[3 * row + 2] * p.z());
  };
  double farthest = 0;
  for (const test::GlbPart& part : glb.parts) {
    for (const auto& p : part.values.at("POSITION")) {
      farthest =
          test::largest(farthest, reach(tile.object["boundingVolume"]["box"], in_tile(glb, p)));
      // The same place by what the file says of itself; its second axis is up.
      const Eigen::Vector3d in_world = test::in_world(glb, p);
      const Eigen::Vector3d expected(world(0, in_world), -world(2, in_world), world(1, in_world));
      const Eigen::Vector3d found =
          (tile.tileset_from_tile * in_tile(glb, p).homogeneous()).hnormalized();
      ASSERT_LT((found - expected).norm(), 1e-5);
    }
  }
  EXPECT_LE(farthest, 1);
  EXPECT_GT(farthest, 0.97);  // no larger than it has to be
}

void expect_provenance(const test::Glb& glb, const test::Glb& full) {
  const json& names = glb.json["asset"]["extras"]["provenance_names"];
  std::set<std::string> materials;
  for (const test::GlbPart& part : glb.parts) {
    for (const auto& id : part.values.at("_FEATURE_ID_0")) {
      const std::string name = names.at(static_cast<size_t>(id[0]));
      ASSERT_TRUE(part.material.starts_with(name)) << part.material << " is " << name;
      materials.insert(name);
    }
  }
  const json& area = glb.json["asset"]["extras"]["area"];
  for (const auto& [name, whole] : full.json["asset"]["extras"]["area"].items()) {
    const double expected = whole.get<double>();
    EXPECT_NEAR(area[name].get<double>(), expected, 0.15 * expected) << name;
    EXPECT_EQ(materials.count(name) > 0, expected > 0) << name;
  }
}

size_t pixels_of(const test::Glb& glb) {
  size_t out = 0;
  for (const ColorImage& image : glb.images) out += image.data.size();
  return out;
}

/// Every 499th splat of splats.glb where its node has it, in the units of the file.
std::vector<Eigen::Vector3d> places_of_splats(const fs::path& path) {
  const std::string bytes = test::read_bytes(path);
  const size_t binary = bytes.find(std::string("BIN\0", 4)) + 4;
  const json file = json::parse(bytes.substr(20, binary - 8 - 20));
  const json& node = file["nodes"][0];
  const json& at = file["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
  const json& accessor = file["accessors"][at.get<size_t>()];
  const json& view = file["bufferViews"][accessor["bufferView"].get<size_t>()];
  const auto q = node["rotation"].get<std::vector<double>>();
  const auto t = node["translation"].get<std::vector<double>>();
  const Eigen::Affine3d placed =
      Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
  std::vector<Eigen::Vector3d> out;
  for (size_t i = 0; i < accessor["count"].get<size_t>(); i += 499) {
    Eigen::Vector3f p;
    std::memcpy(p.data(),
                bytes.data() + binary + view["byteOffset"].get<size_t>() + i * sizeof p,
                sizeof p);
    out.push_back(placed * p.cast<double>());
  }
  return out;
}

// Both files are in one place by their nodes alone. What is left is how far Gaussians lie off the
// fused surface; a shift of one file against the other, as there once was, is many voxels.
TEST(Asset, HasTheSplatsOnItsSurface) {
  constexpr double kVoxel = 0.08;  // [feet]
  const auto median_distance = [](const TempDir& dir) {
    const test::Glb glb = test::parse_glb(test::read_bytes(dir / "out/web/asset.glb"));
    std::vector<test::Triangle> surface;
    for (const test::GlbPart& part : glb.parts) {
      for (const auto& face : part.faces) {
        test::Triangle& t = surface.emplace_back();
        for (size_t k = 0; k < 3; ++k) {
          t.at(k) = test::placed(glb, part.values.at("POSITION")[face.at(k)]);
        }
      }
    }
    std::vector<double> distances;
    for (const Eigen::Vector3d& p : places_of_splats(dir / "out/web/splats.glb")) {
      double least = 1e300;
      for (const test::Triangle& t : surface) {
        least = std::min(least, (test::nearest_on(t, p) - p).norm());
      }
      distances.push_back(least);
    }
    EXPECT_GT(distances.size(), 20u);
    std::nth_element(
        distances.begin(), distances.begin() + long(distances.size() / 2), distances.end());
    return distances[distances.size() / 2];
  };
  EXPECT_LT(median_distance(levels_run().dir), 0.5 * kVoxel * kMetresPerFoot);
  const TempDir local;
  const auto run = run_cgs(levels_run().arguments_from_copy(local, "--local-origin"));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_LT(median_distance(local), 0.5 * kVoxel * kMetresPerFoot);
}

TEST(Asset, LeavesOutFacesThatHoldColoursAndStaysNear) {
  ASSERT_EQ(levels_run().result.exit_code, 0);
  const json report = json::parse(levels_run().result.out);
  const json& mesh = report["mesh"];
  const json& asset = report["web"]["asset.glb"];
  EXPECT_LT(asset["faces"], 0.8 * mesh["certificate"]["faces"].get<double>());
  const json& off = report["web"]["deviations"][0]["with_evidence"];
  const double allowed = mesh["simplification"]["max_error"];
  EXPECT_GT(off["max"], 0.2 * allowed);
  EXPECT_LT(off["max"], allowed + asset["measured_max_error"].get<double>());
}

TEST(Asset, HoldsOnePictureIfAskedFor) {
  constexpr double kTexel = 0.1;  // [feet]
  const TempDir dir;
  const auto run = run_cgs(levels_run().arguments_from_copy(dir, "--json --texture atlas=0.1"));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json atlas = json::parse(run.out)["web"]["texture"]["atlas"];
  EXPECT_NEAR(atlas["texel"].get<double>(), kTexel, 1e-9);
  const ColorImage picture = read_image(dir / "out/mesh/watertight.atlas.jpg");
  EXPECT_EQ(picture.width, atlas["width"]);
  EXPECT_EQ(picture.height, atlas["height"]);
  EXPECT_FALSE(fs::exists(dir / "out/mesh/watertight.view_01.jpg"));
  const test::Glb glb = test::parse_glb(test::read_bytes(dir / "out/web/asset.glb"));
  ASSERT_EQ(glb.images.size(), 1u);
  EXPECT_TRUE(std::any_of(glb.parts.begin(), glb.parts.end(), [](const test::GlbPart& part) {
    return part.material == "observed atlas";
  }));
  const auto refused =
      run_cgs(run_arguments(levels_run().dir / "capture", dir, "-w --texture mural"));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("--texture mural: allowed are photographs, atlas"), std::string::npos)
      << refused.err;
}

TEST(Levels, AreSmallerAndAsFarOffAsTheySay) {
  const TempDir& dir = levels_run().dir;
  const test::ProgramResult& run = levels_run().result;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json levels = parsed(dir / "out/run.json")["stages"]["web"]["result"]["levels"];
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_EQ(json::parse(run.out)["web"]["levels"], levels);
  const auto read = [&](const std::string& name) {
    return test::parse_glb(test::read_bytes(dir / ("out/web/" + name)));
  };
  const json tileset = parsed(dir / "out/web/tileset.json");
  const std::vector<Tile> tiles = tiles_of(tileset);
  ASSERT_EQ(tiles.size(), 3u);
  const test::Glb full = read("asset.glb");
  const auto finest = test::triangles_of_glb(dir / "out/web/asset.glb");
  double coarser = tileset["geometricError"];
  size_t bytes = 0;
  size_t pixels = 0;
  for (size_t i = 0; i < tiles.size(); ++i) {
    const json& tile = tiles[i].object;
    EXPECT_EQ(tile["refine"], "REPLACE");
    const std::string uri = tile["content"]["uri"];
    EXPECT_EQ(uri, i == 2 ? "asset.glb" : "asset.lod" + std::to_string(2 - i) + ".glb");
    const test::Glb glb = read(uri);
    expect_placed(tiles[i], glb);
    expect_provenance(glb, full);
    const auto told = run_cgs("info --json " + (dir / ("out/web/" + uri)).string());
    const json held = json::parse(told.out)["certificate"];
    for (const auto& [key, value] : glb.json["asset"]["extras"]["summary"]["certificate"].items()) {
      EXPECT_EQ(value, held[key]) << uri << " " << key;
    }
    const double error = tile["geometricError"];
    EXPECT_LT(error, coarser);
    coarser = error;
    const auto size = fs::file_size(dir / ("out/web/" + uri));
    EXPECT_GT(size, 1.1 * double(bytes)) << uri;  // a small scene is mostly what each file holds
    EXPECT_GT(double(pixels_of(glb)), 1.2 * double(pixels)) << uri;
    bytes = size;
    pixels = pixels_of(glb);
    if (i == 2) continue;
    const json& level = levels[1 - i];
    EXPECT_EQ(level["file"], uri);
    EXPECT_EQ(level["bytes"], size);
    const double stated = std::max(level["deviation"]["evidence"].get<double>(),
                                   level["deviation"]["inferred"].get<double>());
    EXPECT_NEAR(error, kMetresPerFoot * stated, 1e-12);
    const double found =
        test::two_ways(test::triangles_of_glb(dir / ("out/web/" + uri)), finest);  // in feet
    EXPECT_LE(found, stated + 1e-4) << uri;
    EXPECT_GT(found, 0.2 * stated) << uri;
  }
  EXPECT_EQ(coarser, 0);  // of the finest
  const std::string page = test::read_bytes(dir / "out/report.html");
  EXPECT_NE(page.find(levels[0]["words"].get<std::string>().substr(0, 40)), std::string::npos);
}

TEST(Levels, AreOutputsOfTheRunAsOthersAre) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  const auto succeeds = [&](const std::string& more) {
    const auto run = run_cgs(run_arguments(dir, more));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return web_files(dir);
  };
  const auto three = succeeds("--lods 3");
  const std::set<std::string> plain = {"asset.glb", "splats.glb", "splats.spz"};
  std::set<std::string> expected = plain;
  for (const char* name : {"asset.lod1.glb", "asset.lod2.glb", "asset.lod3.glb", "tileset.json"}) {
    expected.insert(name);
  }
  EXPECT_EQ(names_of(three), expected);
  // A level that is gone is noticed, and made again as it was.
  fs::remove(dir / "out/web/asset.lod2.glb");
  const auto verified = run_cgs("verify " + (dir / "out").string());
  EXPECT_EQ(verified.exit_code, 3);
  EXPECT_NE(verified.out.find("web/asset.lod2.glb: missing"), std::string::npos) << verified.out;
  EXPECT_TRUE(succeeds("--lods 3") == three);
  EXPECT_EQ(run_cgs("verify " + (dir / "out").string()).exit_code, 0);
  // Fewer leave none of the others behind, and asset.glb is the same with and without.
  const auto one = succeeds("-w --lods 1");
  expected.erase("asset.lod2.glb");
  expected.erase("asset.lod3.glb");
  EXPECT_EQ(names_of(one), expected);
  const auto none = succeeds("-w");
  EXPECT_EQ(names_of(none), plain);
  EXPECT_TRUE(none.at("asset.glb") == three.at("asset.glb"));
  const json record = parsed(dir / "out/run.json");
  EXPECT_FALSE(record["outputs"].contains("web/tileset.json"));
  EXPECT_FALSE(record["stages"]["web"]["result"].contains("levels"));
}

TEST(Levels, GoOnFromWhatAPromiseLeaves) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  const auto run = run_cgs(run_arguments(dir, "--lods 1 --max-error 20cm --max-size 60kB"));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_LE(fs::file_size(dir / "out/web/asset.glb"), 60'000u);
  // So small an asset is mostly JSON, which does not tell.
  const json web = parsed(dir / "out/report.json").at("web");
  EXPECT_LT(web.at("levels").at(0).at("faces"), web.at("asset.glb").at("form").at("faces"));
}

TEST(Levels, MoreThanDifferAreRefused) {
  const TempDir dir;
  const auto run = run_cgs(run_arguments(dir, "--lods 6"));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--lods"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(dir / "out"));
}

}  // namespace
}  // namespace cgs
