// SPDX-License-Identifier: GPL-3.0-or-later
//
// `cgs run --refine-poses` on a small portal capture whose cameras are stated half a degree
// off.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/scenes/cameras_json.h"
#include "samples/capture/truth.h"
#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"
#include "tests/support/unposed_photos.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ProgramResult;
using test::run_cgs;

constexpr int kDivisor = 2;

class RefinedPoses : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new test::TempDir;
    auto views = capture_views(kDivisor);
    views.resize(4);
    test::copy_portal_capture(scene(), kDivisor, views.size());
    json transforms = json::parse(test::read_bytes(scene() / "transforms.json"));
    for (size_t i = 0; i < views.size(); ++i) {
      json& rows = transforms["frames"][i]["transform_matrix"];
      const Eigen::Vector3d axis(1, double(i) - 1.5, 0.5);
      const Eigen::AngleAxisd turn(0.6 * M_PI / 180, axis.normalized());
      for (size_t c = 0; c < 3; ++c) {
        const Eigen::Vector3d turned = turn * Eigen::Vector3d(rows[0][c], rows[1][c], rows[2][c]);
        for (size_t r = 0; r < 3; ++r) rows[r][c] = turned[static_cast<Eigen::Index>(r)];
      }
      rows[0][3] = rows[0][3].get<double>() + 0.01 * (double(i) - 1.5);
    }
    test::write_bytes(scene() / "transforms.json", transforms.dump());
    const auto result = run(out(), " --refine-poses --threads 2");
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  static void TearDownTestSuite() { delete dir_; }

  static fs::path scene() { return *dir_ / "capture"; }
  static fs::path out() { return *dir_ / "out"; }
  static ProgramResult run(const fs::path& output, const std::string& more) {
    return run_cgs("run " + scene().string() +
                   " --views view_01,view_02,view_03 --set steps=0 --voxel-size 0.1 -q -o " +
                   output.string() + more);
  }
  static json read(const fs::path& file) { return json::parse(test::read_bytes(file)); }

  static test::TempDir* dir_;
};
test::TempDir* RefinedPoses::dir_ = nullptr;

TEST_F(RefinedPoses, AreThoseOfTheModel) {
  const Scene model = read_cameras_json(out() / "model/cameras.json");
  const auto views = capture_views(kDivisor);
  std::vector<Camera> solved;
  std::vector<Camera> truth;
  for (size_t i = 0; i < model.views.size(); ++i) {
    solved.push_back(model.views[i].camera);
    truth.push_back(views[i].camera);
  }
  ASSERT_EQ(solved.size(), 4u);
  EXPECT_LT(test::pose_errors(solved, truth).rotation, 0.06);
}

TEST_F(RefinedPoses, AreStatedWithTheirErrors) {
  const json record = read(out() / "run.json");
  EXPECT_EQ(record["request"]["refine_poses"], true);
  const json& refined = record["refined_poses"];
  EXPECT_EQ(refined, read(out() / "report.json")["refined_poses"]);
  ASSERT_EQ(refined["views"].size(), 4u);
  EXPECT_GT(refined["error_before"], 2 * refined["error_after"].get<double>());
  EXPECT_GT(refined["views"][1]["degrees"], 0.1);
  EXPECT_TRUE(refined["views"][3]["refined"].get<bool>());
  const std::string page = test::read_bytes(out() / "report.html");
  EXPECT_NE(page.find("2 input and 1 held-out cameras moved"), std::string::npos);
}

TEST_F(RefinedPoses, AreTheSameForAnyNumberOfThreadsAndVerified) {
  const fs::path again = *dir_ / "again";
  ASSERT_EQ(run(again, " --refine-poses --threads 1").exit_code, 0);
  for (const char* file : {"model/refined_poses.json", "model/cameras.json", "web/asset.glb"}) {
    EXPECT_EQ(test::read_bytes(out() / file), test::read_bytes(again / file)) << file;
  }
  const auto verified = run_cgs("verify " + out().string());
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
}

// Without it, the same command asks for something else.
TEST_F(RefinedPoses, DecideAllStages) {
  const auto other = run(out(), "");
  EXPECT_EQ(other.exit_code, 2) << other.err;
  const auto resumed = run(out(), " --refine-poses");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  const fs::path plain = *dir_ / "plain";
  const auto given = run(plain, "");
  EXPECT_EQ(given.exit_code, 0) << given.err;
  EXPECT_NE(given.err.find("--refine-poses"), std::string::npos) << given.err;  // it is advised
  EXPECT_FALSE(read(plain / "run.json")["request"].contains("refine_poses"));
  EXPECT_GT(read(plain / "run.json")["camera_fit"]["error"], 0.5);
}

TEST_F(RefinedPoses, StayWhereALookWithoutThemIsTaken) {
  const std::string poses = test::read_bytes(out() / "model/refined_poses.json");
  ASSERT_EQ(run(out(), " --preview").exit_code, 0);
  EXPECT_EQ(test::read_bytes(out() / "model/refined_poses.json"), poses);
  EXPECT_TRUE(fs::exists(out() / "preview/report.html"));
  EXPECT_FALSE(fs::exists(out() / "preview/model/refined_poses.json"));
}

}  // namespace
}  // namespace cgs
