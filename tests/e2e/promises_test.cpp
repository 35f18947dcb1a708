// SPDX-License-Identifier: GPL-3.0-or-later
//
// What `cgs run` promises, held against the files it wrote, on a small portal capture. Distances
// are measured here by trying every triangle, from places chosen here, on the file as Draco decodes
// it.
#include <algorithm>
#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/meshes/mesh_ply.h"
#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"
#include "tests/support/triangles.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::run_cgs;
using test::TempDir;
using test::Triangle;
using test::triangles_of_glb;
using test::two_ways;

std::string run_arguments(const TempDir& dir, const std::string& out) {
  return "run " + (dir / "capture").string() +
         " --views view_01,view_02,view_03 --assume-unit m --set steps=0 -q -o " +
         (dir / out).string();
}

json record_of(const fs::path& run) { return json::parse(test::read_bytes(run / "run.json")); }
json result_of(const fs::path& run, const char* stage) {
  return record_of(run)["stages"][stage]["result"];
}

std::vector<Triangle> triangles_of_ply(const fs::path& path) {
  const MeshFile file = read_mesh_ply(path);
  std::vector<Triangle> out;
  for (const auto& face : file.mesh.faces) {
    Triangle& t = out.emplace_back();
    for (size_t k = 0; k < 3; ++k) {
      t.at(k) = file.frame.file_from_internal(file.mesh.vertices[face.at(k)].cast<double>());
    }
  }
  return out;
}

// The surface of the volume, as another command meshes it without simplification.
std::vector<Triangle> fused_triangles(const fs::path& run, const fs::path& scratch) {
  EXPECT_EQ(
      run_cgs("mesh " + (run / "volume.vdb").string() + " --simplify 0 -q -o " + scratch.string())
          .exit_code,
      0);
  return triangles_of_ply(scratch / "watertight.ply");
}

// Of a mesh file: the area that photographs show, and what of it has no sigma above a length.
std::pair<double, double> areas_known_to(const fs::path& path, double length) {
  const MeshFile file = read_mesh_ply(path);
  const std::vector<Triangle> triangles = triangles_of_ply(path);
  double seen = 0;
  double known = 0;
  for (size_t f = 0; f < triangles.size(); ++f) {
    const Provenance label = file.mesh.provenance[f];
    if (label != Provenance::Observed && label != Provenance::SingleView) continue;
    const Triangle& t = triangles[f];
    const double area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
    seen += area;
    bool is_known = true;
    for (const uint32_t v : file.mesh.faces[f]) {
      is_known = is_known && file.frame.scale * double(file.mesh.sigma[v]) <= length;
    }
    if (is_known) known += area;
  }
  return {seen, known};
}

TEST(MaxError, IsKeptByEveryMeshFile) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 9);
  const auto run = run_cgs(run_arguments(dir, "out") + " --max-error 12cm --json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const fs::path out = dir / "out";
  const std::vector<Triangle> fused = fused_triangles(out, dir / "fused");
  for (const auto& [file, found] :
       {std::pair("asset.glb", two_ways(triangles_of_glb(out / "web/asset.glb"), fused)),
        std::pair("watertight.ply",
                  two_ways(triangles_of_ply(out / "mesh/watertight.ply"), fused))}) {
    EXPECT_LE(found, 0.12) << file;
    EXPECT_GT(found, 0.012) << file << ": nothing was simplified";
  }
  const json mesh = result_of(out, "mesh")["promise"];
  EXPECT_NEAR(mesh["promised"].get<double>(), 0.12, 1e-12);
  for (const char* file : {"surface.ply", "watertight.ply", "watertight.stl", "watertight.3mf"}) {
    EXPECT_LE(mesh["files"][file].get<double>(), 0.108) << file;
  }
  const json asset = result_of(out, "web")["asset.glb"]["deviation"];
  EXPECT_LE(asset["evidence"].get<double>(), 0.12);
  EXPECT_LE(asset["inferred"].get<double>(), 0.12);
  // The evidence is stated beside it, in the page, too.
  const auto [seen, known] = areas_known_to(dir / "fused/watertight.ply", 0.12);
  EXPECT_GT(known, 0.05 * seen);
  EXPECT_LT(known, 0.95 * seen);
  EXPECT_NEAR(mesh["area_seen"].get<double>(), seen, 1e-3 * seen);
  EXPECT_NEAR(mesh["area_known_as_well"].get<double>(), known, 1e-3 * seen);
  const std::string page = test::read_bytes(out / "report.html");
  EXPECT_NE(page.find("<h2>Promises</h2>"), std::string::npos);
  EXPECT_NE(page.find("off the fused surface, 120 mm were asked for"), std::string::npos);
}

TEST(MaxSize, IsKeptWithTheDeviationStated) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 9);
  ASSERT_EQ(run_cgs(run_arguments(dir, "out")).exit_code, 0);
  const fs::path out = dir / "out";
  const fs::path asset = out / "web/asset.glb";
  const auto whole = fs::file_size(asset);
  const std::vector<Triangle> fused = fused_triangles(out, dir / "fused");
  double finer = 0;
  for (const double part : {1.5, 0.8, 0.65}) {
    const auto limit = static_cast<size_t>(part * double(whole));
    const auto run = run_cgs(run_arguments(dir, "out") + " -w --max-size " + std::to_string(limit));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_LE(fs::file_size(asset), limit);
    const json web = result_of(out, "web")["asset.glb"];
    EXPECT_EQ(web["bytes"], fs::file_size(asset));
    const double detail = web["form"]["detail"];
    EXPECT_EQ(detail > 0, part < 1);
    EXPECT_GE(detail, finer);
    finer = detail;
    const double stated = std::max(web["deviation"]["evidence"].get<double>(),
                                   web["deviation"]["inferred"].get<double>());
    const double found = two_ways(triangles_of_glb(asset), fused);
    EXPECT_LE(found, stated + 1e-4) << part;
    EXPECT_GT(found, 0.2 * stated) << part;
    if (detail > 0) EXPECT_LE(web["deviation"]["evidence"].get<double>(), 1.001 * detail);
  }
}

TEST(MaxSize, ThatCannotBeReachedSaysWhatCanAndKeepsTheOthers) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  const auto run = run_cgs(run_arguments(dir, "out") + " --max-size 1kB");
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  const std::string before = "asset.glb takes ";
  const size_t at = run.err.find(before);
  ASSERT_NE(at, std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(dir / "out/web/asset.glb"));
  for (const char* file : {"mesh/watertight.ply", "mesh/watertight.obj", "web/splats.glb"}) {
    EXPECT_TRUE(fs::exists(dir / ("out/" + std::string(file)))) << file;
  }
  // What it says can be reached can be reached.
  const size_t least = std::stoul(run.err.substr(at + before.size()));
  const auto again = run_cgs(run_arguments(dir, "out") + " -w --max-size " + std::to_string(least));
  EXPECT_EQ(again.exit_code, 0) << run.err << again.err;
  EXPECT_LE(fs::file_size(dir / "out/web/asset.glb"), least);
}

TEST(Promises, RedoWhatTheyChangeAlone) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  const auto begun = [&](const std::string& options) {
    const auto run = run_cgs(run_arguments(dir, "out") + " " + options);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    json seconds = json::object();
    const json record = record_of(dir / "out");
    for (const auto& [stage, entry] : record["stages"].items()) {
      seconds[stage] = entry["seconds"];  // told anew by a stage that ran
    }
    return seconds;
  };
  const json plain = begun("");
  EXPECT_EQ(begun(""), plain);
  const json sized = begun("-w --max-size 1GB");
  EXPECT_EQ(sized["mesh"], plain["mesh"]);
  EXPECT_NE(sized["web"], plain["web"]);
  EXPECT_EQ(begun("--max-size 1GB"), sized);
  const json near = begun("-w --max-size 1GB --max-error 5cm");
  EXPECT_EQ(near["model"], plain["model"]);
  EXPECT_NE(near["mesh"], plain["mesh"]);
  EXPECT_EQ(begun("--max-size 1GB --max-error 5cm"), near);
}

TEST(Promises, ThatContradictOrCannotBeReadAreRefusedBeforeAnyWork) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  for (const auto& [options, words] :
       {std::pair("--max-error 1cm --simplify 2mm", "--simplify"),
        std::pair("--max-error 1cm --compression-error 2mm", "--compression-error"),
        std::pair("--max-error 2parsec", "unit of length"),
        std::pair("--max-size 2apples", "size of a file")}) {
    const auto run = run_cgs(run_arguments(dir, "out") + " " + options);
    EXPECT_EQ(run.exit_code, 2) << options;
    EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_FALSE(fs::exists(dir / "out")) << options;
  }
}

}  // namespace
}  // namespace cgs
