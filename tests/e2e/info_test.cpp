// SPDX-License-Identifier: GPL-3.0-or-later
// cgs info of files, and of folders that are no scene.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/tools/LevelSetSphere.h>

#include "io/images/exr.h"
#include "io/meshes/mesh_ply.h"
#include "io/volumes/vdb.h"
#include "tests/support/run_cgs.h"
#include "tests/support/solid_meshes.h"

namespace cgs {
namespace {

using nlohmann::json;
using test::run_cgs;
using test::TempDir;

json json_of(const std::filesystem::path& path) {
  const auto result = run_cgs("info " + path.string() + " --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return json::parse(result.out);
}

TEST(Info, CertifiesAMesh) {
  const TempDir dir;
  test::write_bytes(dir / "a.obj", test::obj_text(test::torus_mesh(0.6, 0.2)));
  const json out = json_of(dir / "a.obj");
  EXPECT_EQ(out["kind"], "mesh");
  EXPECT_EQ(out["certificate"]["genus"], 1);
  EXPECT_EQ(out["certificate"]["euler_number"], 0);
  EXPECT_TRUE(out["certificate"]["passed"]);
  EXPECT_EQ(out["counts"]["faces"], 2 * 128 * 64);
}

TEST(Info, ListsTheGridsOfAVolumeOfAnotherProgram) {
  const TempDir dir;
  openvdb::initialize();
  auto sphere =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(6, openvdb::Vec3f(10, 20, 30), 0.5f);
  sphere->setName("ls_sphere");
  auto empty = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
  empty->setName("velocity");
  write_vdb(dir / "a.vdb", {sphere, empty}, {});
  const json out = json_of(dir / "a.vdb");
  EXPECT_EQ(out["kind"], "volume");
  EXPECT_EQ(out["units"], "unknown");
  ASSERT_EQ(out["grids"].size(), 2u);
  const json& grid = out["grids"][0];
  EXPECT_EQ(grid["name"], "ls_sphere");
  EXPECT_EQ(grid["class"], "level set");
  EXPECT_EQ(grid["active_voxels"], sphere->activeVoxelCount());
  EXPECT_DOUBLE_EQ(grid["voxel_size"][1], 0.5);
  for (int k = 0; k < 3; ++k) {  // a sphere and three voxels of 0.5 around it
    EXPECT_NEAR(grid["bounds"]["min"][k].get<double>(), 10 * (k + 1) - 7.5, 0.51);
    EXPECT_NEAR(grid["bounds"]["max"][k].get<double>(), 10 * (k + 1) + 7.5, 0.51);
  }
  EXPECT_NEAR(grid["range"][0].get<double>(), -1.5, 0.05);
  EXPECT_NEAR(grid["range"][1].get<double>(), 1.5, 0.05);
  EXPECT_TRUE(out["grids"][1]["bounds"].is_null());
  const std::string text = run_cgs("info " + (dir / "a.vdb").string()).out;
  EXPECT_NE(text.find("not made by cgs"), std::string::npos) << text;
  EXPECT_NE(text.find("velocity"), std::string::npos) << text;
}

TEST(Info, ListsTheChannelsOfAnExr) {
  const TempDir dir;
  ExrImage image;
  image.width = 2;
  image.height = 2;
  image.channels = {{"Z", {1, 2, std::numeric_limits<float>::quiet_NaN(), 4}}};
  image.text["units"] = "mm";
  write_exr(dir / "a.exr", image);
  const json out = json_of(dir / "a.exr");
  EXPECT_EQ(out["kind"], "raster");
  ASSERT_EQ(out["channels"].size(), 1u);
  EXPECT_EQ(out["channels"][0]["range"], json({1, 4}));
  EXPECT_DOUBLE_EQ(out["channels"][0]["finite"], 0.75);
  EXPECT_EQ(out["attributes"]["units"], "mm");
}

TEST(Info, SaysWhereARunStoppedAndRefusesWhatIsNoRecord) {
  const TempDir dir;
  std::filesystem::create_directory(dir / "run");
  test::write_bytes(dir / "run/run.json",
                    R"({"program": "cgs", "request": {"scene": "photos", "views": "1,2"}, "stages":
                    {"model": {"seconds": 3, "peak_memory": 1048576, "result": null}}})");
  const json out = json_of(dir / "run");
  EXPECT_EQ(out["kind"], "run");
  EXPECT_FALSE(out["finished"]);
  EXPECT_EQ(out["stages"][0]["name"], "model");
  EXPECT_NE(run_cgs("info " + (dir / "run").string()).out.find("NOT finished"), std::string::npos);
  for (const char* text : {"[]", "{\"request\": {}}", "{\"request\": {}"}) {
    test::write_bytes(dir / "run/run.json", text);
    const auto refused = run_cgs("info " + (dir / "run").string());
    EXPECT_EQ(refused.exit_code, 3) << text;
    EXPECT_NE(refused.err.find("no known layout"), std::string::npos) << refused.err;
  }
  test::write_bytes(dir / "run/run.json", R"({"request": 3, "stages": {}})");
  const auto refused = run_cgs("info " + (dir / "run").string());
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("run.json: request states no scene"), std::string::npos)
      << refused.err;
}

TEST(Info, AReportThatIsNotTakenWholeIsAnError) {
  const test::TempDir dir;
  const std::string error = " 2>" + (dir / "err").string();
  const std::string info =
      std::string(CGS_BINARY) + " info " + dir.path().string() + "/a.ply --json";
  write_mesh_ply(dir / "a.ply", test::cube_mesh(1).mesh, Frame{});
  for (const std::string& command :
       {info + " >/dev/full" + error,
        std::string(CGS_BINARY) + " --help >/dev/full" + error,
        "bash -c 'set -o pipefail; { sleep 0.3; " + info + error + "; } | true'"}) {
    const int status = std::system(command.c_str());
    ASSERT_TRUE(WIFEXITED(status)) << command;
    EXPECT_EQ(WEXITSTATUS(status), 5) << command;
    EXPECT_EQ(test::read_bytes(dir / "err").rfind("cgs: IO: standard output: ", 0), 0u) << command;
  }
}

TEST(Info, StrictTakesAWarningOfAFileForAnError) {
  const TempDir dir;
  const std::string triangle =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  test::write_bytes(dir / "a.ply", triangle);
  test::write_bytes(dir / "b.ply", triangle + "3 0 1 2\n");
  for (const std::string json : {"", " --json"}) {
    const std::string strict = json + " --strict";
    EXPECT_EQ(run_cgs("info " + (dir / "a.ply").string() + strict).exit_code, 0);
    EXPECT_EQ(run_cgs("info " + (dir / "b.ply").string() + json).exit_code, 0);
    const auto refused = run_cgs("info " + (dir / "b.ply").string() + strict);
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_NE(refused.err.find("--strict: a warning counts as an error"), std::string::npos);
  }
}

TEST(Info, RefusesOptionsOfScenes) {
  const TempDir dir;
  test::write_bytes(dir / "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  const std::string info = "info " + (dir / "a.off").string();
  EXPECT_EQ(run_cgs(info + " --json --strict").exit_code, 0);
  const auto refused = run_cgs(info + " --views 1,2");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("--views is for folders of photographs"), std::string::npos);
}

}  // namespace
}  // namespace cgs
