// SPDX-License-Identifier: GPL-3.0-or-later
//
// `cgs run --preview`: a first look, and nothing of the run itself.
#include "convert/run/preview.h"

#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"

namespace cgs::e2e_preview_test {
namespace {

namespace fs = std::filesystem;
using test::TempDir;

test::ProgramResult preview(const fs::path& out, const std::string& more = "") {
  return test::run_cgs("run " + test::portal_capture(3).string() +
                       " --views view_01,view_02,view_03 --preview -o " + out.string() + more);
}

TEST(Preview, SaysHowMuchIsMeasuredAndLeavesTheRunToCome) {
  const TempDir dir;
  const fs::path out = dir / "out";
  const test::ProgramResult run = preview(out);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("of the surface in the photographs is measured"), std::string::npos)
      << run.err;
  EXPECT_EQ(run.err.find("hardly worth"), std::string::npos) << run.err;
  EXPECT_TRUE(fs::exists(out / "preview/report.html"));
  EXPECT_TRUE(fs::exists(out / "preview/mesh/watertight.ply"));
  EXPECT_FALSE(fs::exists(out / "run.json"));
  const auto report = nlohmann::json::parse(test::read_bytes(out / "preview/report.json"));
  EXPECT_EQ(report["model"]["settings"]["steps"], "0");
  EXPECT_TRUE(report["certificate"]["passed"].get<bool>());
}

// The input of the portal is small: a minute needs no look before it.
TEST(Preview, ComesFirstWhereARunTakesMinutes) {
  Scene full;
  for (int i = 0; i < 4; ++i) {
    View view;
    view.camera.width = 2000;
    view.camera.height = 1500;
    full.input.push_back(i);
    full.views.push_back(view);
  }
  const auto of_size = [&](int width, int height) {
    Scene scene = full;
    for (View& view : scene.views) {
      view.camera.width = width;
      view.camera.height = height;
    }
    return scene;
  };
  EXPECT_TRUE(is_worth_a_preview(of_size(1000, 750), full));
  EXPECT_TRUE(is_worth_a_preview(full, full));
  EXPECT_FALSE(is_worth_a_preview(of_size(250, 188), full)) << "a minute";
  EXPECT_FALSE(is_worth_a_preview(of_size(504, 378), of_size(504, 378))) << "a minute";
  full.input.assign(40, 0);
  EXPECT_FALSE(is_worth_a_preview(of_size(250, 188), full)) << "as small as its preview";
}

TEST(Preview, OfARunShowsItsPhotographs) {
  const TempDir dir;
  Terminal terminal = Terminal::silent();
  RunRequest request;
  request.scene.path = test::portal_capture(3);
  request.scene.options.views = "view_01,view_03";
  request.output = dir / "out";
  const OpenedScene opened = open_scene(request.scene, {}, terminal);
  look_first(request, opened, terminal);
  EXPECT_FALSE(fs::exists(dir / "out")) << "not worth it";
  RunRequest gone = request;
  gone.scene.path = dir / "gone";
  EXPECT_NO_THROW(look_first(gone, opened, terminal)) << "whatever is wrong, the run goes on";
  (void)write_preview(request, terminal);
  const auto report = nlohmann::json::parse(test::read_bytes(dir / "out/preview/report.json"));
  EXPECT_EQ(report["model"]["depth_of_views"].size(), 2U);
}

TEST(DryRun, ForetellsWhatARunTakesAndMakesNothing) {
  const TempDir dir;
  const std::string scene = test::portal_capture(3).string();
  const auto foretold = [&](const std::string& more) {
    const test::ProgramResult run =
        test::run_cgs("run " + scene + more + " --dry-run --json -o " + (dir / "out").string());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return nlohmann::json::parse(run.out);
  };
  const nlohmann::json small = foretold(" --views view_01,view_02 --threads 1");
  EXPECT_EQ(small["input"], nlohmann::json({"view_01", "view_02"}));
  EXPECT_EQ(small["held_out"].size(), 6U);
  EXPECT_EQ(small["pixels"], 2 * 168 * 126);
  EXPECT_EQ(small["threads"], 1);
  const nlohmann::json large = foretold(" --use-all");
  EXPECT_GT(large["most_memory"], small["most_memory"]);
  EXPECT_GT(large["disk"], small["disk"]);
  for (const char* wrong : {" --voxel-size 5q",
                            " --known-distance typo:1,2 view_01:3,4 1m",
                            " --known-distance view_01:1,2 view_01:99999,4 1m"}) {
    const test::ProgramResult run =
        test::run_cgs("run " + scene + wrong + " --dry-run -o " + (dir / "out").string());
    EXPECT_EQ(run.exit_code, 2) << wrong << run.err;
  }
  EXPECT_FALSE(fs::exists(dir / "out"));
}

// Which take minutes.
TEST(SolvedCameras, StayWhateverIsRefusedLater) {
  const TempDir dir;
  fs::create_directories(dir / "photos");
  for (const char* name : {"view_01.png", "view_02.png", "view_03.png"}) {
    fs::copy(test::portal_capture(1) / "images" / name, dir / "photos" / name);
  }
  const std::string photos = (dir / "photos").string();
  const auto refused = [&](const std::string& command, const std::string& output) {
    const test::ProgramResult run =
        test::run_cgs(command + photos + " --marker-size 80mm -q -o " + (dir / output).string());
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find("no square marker is shown"), std::string::npos) << run.err;
  };
  refused("run ", "run");
  const fs::path stored = dir / "run/model/colmap/poses.json";
  ASSERT_TRUE(fs::exists(stored));
  const auto before = fs::last_write_time(stored);
  refused("run ", "run");
  EXPECT_EQ(fs::last_write_time(stored), before) << "taken, not solved for again";
  refused("train ", "model");
  EXPECT_TRUE(fs::exists(dir / "model/colmap/poses.json"));
}

TEST(Preview, ExcludesWhatItChooses) {
  const TempDir dir;
  const test::ProgramResult run = preview(dir / "out", " --downscale 2");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--preview"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(dir / "out"));
}

}  // namespace
}  // namespace cgs::e2e_preview_test
