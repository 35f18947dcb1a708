// SPDX-License-Identifier: GPL-3.0-or-later
//
// cgs tradeoff as a user calls it, on the portal capture in the size of a thumbnail.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

using nlohmann::json;
using test::run_cgs;
using test::TempDir;

std::string arguments(const TempDir& dir, const std::string& out) {
  return "tradeoff " + (dir / "capture").string() +
         " --views view_01,view_02,view_03 --assume-unit m -q -o " + (dir / out).string();
}

// What does not depend on how fast the machine was: all figures of the settings but their costs.
json qualities(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "tradeoff.json";
  if (!std::filesystem::exists(file)) return json::array();
  json settings = json::parse(test::read_bytes(file))["settings"];
  for (json& setting : settings) {
    setting.erase("cost");
    setting.erase("command");  // names the folder
  }
  return settings;
}

TEST(Tradeoff, MeasuresRecommendsAndResumes) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  const auto whole =
      run_cgs(arguments(dir, "whole") + " --want 'size<1MB' --want 'time<1h' --json");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  const json report = json::parse(whole.out);
  EXPECT_TRUE(report["left_out"].empty());
  EXPECT_EQ(report["noise"]["repeats"], 3);
  EXPECT_GE(report["settings"].size(), 20u);
  // With time and room for all, the surface that the others are held against wins.
  EXPECT_EQ(report["recommendation"]["setting"], report["finest"]);
  for (const char* front : {"pictures", "geometry", "files"}) {
    EXPECT_GE(report["fronts"][front].size(), 2u) << front;
  }
  // 28 x 21 pixels do not divide by 4, and that does not end the others.
  size_t failed = 0;
  for (const json& setting : report["settings"]) failed += setting.contains("failed") ? 1 : 0;
  EXPECT_EQ(failed, 1u);

  // Stopped again and again in the middle of a stage, until the finest surface is there.
  double minutes = 0.02;
  while (qualities(dir / "parts").size() < 5 && minutes < 5) {
    const auto part = run_cgs(arguments(dir, "parts") + " --minutes " + std::to_string(minutes));
    ASSERT_TRUE(part.exit_code == 0 || part.exit_code == 4) << part.err;
    minutes *= 2;
  }
  const json done = qualities(dir / "whole");
  const json parts = qualities(dir / "parts");
  ASSERT_GE(parts.size(), 5u);
  for (const json& setting : parts) {
    EXPECT_EQ(std::count(done.begin(), done.end(), setting), 1) << setting.dump(1);
  }
  const auto nothing_new = run_cgs(arguments(dir, "parts") + " --minutes 0");
  EXPECT_NE(nothing_new.out.find("Left out as time was up"), std::string::npos) << nothing_new.out;

  // A setting is what its command line makes.
  const json& draft = report["settings"][1];
  ASSERT_EQ(draft["label"], "draft");
  const std::string command = draft["command"].get<std::string>();
  ASSERT_EQ(command.substr(0, 4), "cgs ");
  ASSERT_EQ(run_cgs(command.substr(4) + " -q").exit_code, 0) << command;
  for (const auto& [file, path] : {std::pair("gaussians.ply", "model/gaussians.ply"),
                                   std::pair("watertight.ply", "mesh/watertight.ply"),
                                   std::pair("asset.glb", "web/asset.glb")}) {
    const std::filesystem::path made = command.substr(command.rfind(' ') + 1);
    EXPECT_EQ(std::filesystem::file_size(made / path), draft["bytes"][file]) << file;
  }
}

TEST(Tradeoff, RefusesBadRequestsInOneLineBeforeAnyWork) {
  const TempDir dir;
  test::copy_portal_capture(dir / "capture", 18);
  const std::string scene =
      "tradeoff " + (dir / "capture").string() + " -o " + (dir / "o").string();
  for (const std::string& bad : {std::string("--want speed=3"),
                                 std::string("--want 'error<2apples'"),
                                 std::string("--want 'error<2mm'"),  // of a scene without scale
                                 std::string("--minutes -1"),
                                 std::string("--assume-unit parsec")}) {
    const auto result = run_cgs(scene + " " + bad);
    EXPECT_EQ(result.exit_code, 2) << bad;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(dir / "o")) << bad;
  }
  EXPECT_EQ(run_cgs(scene + " --reference " + (dir / "none.ply").string()).exit_code, 3);
  // Finished stages belong to one scene.
  ASSERT_EQ(run_cgs(scene + " --minutes 0 -q").exit_code, 4);
  const auto other = run_cgs(scene + " --minutes 0 --views 0,1");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("views"), std::string::npos) << other.err;
  // A folder holds a run or measurements, and these are of one number of threads.
  const auto run = run_cgs("run" + scene.substr(8) + " -q");
  EXPECT_NE(run.err.find("another run (different: command, threads)"), std::string::npos)
      << run.err;
  const auto threads = run_cgs(scene + " --minutes 0 --threads 7");
  EXPECT_NE(threads.err.find("different: threads"), std::string::npos) << threads.err;
}

}  // namespace
}  // namespace cgs
