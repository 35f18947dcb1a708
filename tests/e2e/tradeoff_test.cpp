// SPDX-License-Identifier: GPL-3.0-or-later
//
// cgs tradeoff as a user calls it, on the portal capture in the size of a thumbnail.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "samples/capture/files.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

using nlohmann::json;
using test::run_cgs;
using test::TempDir;

void make_capture(const std::filesystem::path& folder) {
  const auto views = capture_views(18);
  write_capture(folder, portal_scene(), views, input_cameras(views));
}

std::string arguments(const TempDir& dir, const std::string& out) {
  return "tradeoff " + (dir / "capture").string() +
         " --views view_01,view_02,view_03 --assume-unit m -q -o " + (dir / out).string();
}

// What does not depend on how fast the machine was: all figures of the settings but their costs.
json qualities(const std::filesystem::path& folder) {
  json settings = json::parse(test::read_bytes(folder / "tradeoff.json"))["settings"];
  for (json& setting : settings) {
    setting.erase("cost");
    setting.erase("command");  // names the folder
  }
  return settings;
}

TEST(Tradeoff, MeasuresRecommendsAndResumes) {
  const TempDir dir;
  make_capture(dir / "capture");
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

  // Stopped after a second, in the middle of a stage, and again at once.
  const auto started = run_cgs(arguments(dir, "parts") + " --minutes 0.03");
  EXPECT_TRUE(started.exit_code == 0 || started.exit_code == 4) << started.err;
  const auto nothing_new = run_cgs(arguments(dir, "parts") + " --minutes 0");
  EXPECT_EQ(nothing_new.exit_code, started.exit_code) << nothing_new.err;
  if (started.exit_code == 0) {
    EXPECT_NE(started.out.find("Left out as time was up"), std::string::npos) << started.out;
  }
  const auto resumed = run_cgs(arguments(dir, "parts"));
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(qualities(dir / "parts"), qualities(dir / "whole"));

  // A setting is what its command line makes.
  const json& draft = report["settings"][1];
  ASSERT_EQ(draft["label"], "draft");
  const std::string command = draft["command"].get<std::string>();
  ASSERT_EQ(command.substr(0, 4), "cgs ");
  ASSERT_EQ(run_cgs(command.substr(4) + " -q").exit_code, 0) << command;
  for (const auto& [file, path] : {std::pair("gaussians.ply", "model/gaussians.ply"),
                                   std::pair("watertight.ply", "mesh/watertight.ply"),
                                   std::pair("asset.glb", "web/asset.glb")}) {
    EXPECT_EQ(std::filesystem::file_size(dir / "whole/run" / path), draft["bytes"][file]) << file;
  }
}

TEST(Tradeoff, RefusesBadRequestsInOneLineBeforeAnyWork) {
  const TempDir dir;
  make_capture(dir / "capture");
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
}

}  // namespace
}  // namespace cgs
