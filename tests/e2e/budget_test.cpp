// SPDX-License-Identifier: GPL-3.0-or-later
//
// `cgs run --budget`: what it chooses and keeps. How well times are met is no matter of a test: see
// docs/tradeoff.md for what was measured.
#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/portal_capture.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::run_cgs;
using test::TempDir;

class Budget : public testing::Test {
 protected:
  // 252 x 189 pixels at 2, 168 x 126 at 3.
  void make_capture(int divisor) const { test::copy_portal_capture(dir_ / "capture", divisor); }

  test::ProgramResult run(const std::string& budget, const std::string& more = "") const {
    return run_cgs("run " + (dir_ / "capture").string() +
                   " --views view_01,view_02,view_03 --assume-unit m -q -o " + out().string() +
                   " --budget " + budget + " " + more);
  }

  fs::path out() const { return dir_ / "out"; }
  json file(const char* name) const { return json::parse(test::read_bytes(out() / name)); }

  TempDir dir_;
};

TEST_F(Budget, MuchTimeBuysEverythingAndTheChoiceIsKept) {
  make_capture(2);
  const auto first = run("10h");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const json chosen = file("budget.json");
  EXPECT_EQ(chosen["downscale"], 1);
  EXPECT_EQ(chosen["preset"], "standard");
  EXPECT_LT(chosen["trials"][0]["pixels"], 3.0 * 252 * 189);  // of smaller pictures than those
  EXPECT_FALSE(fs::exists(out() / "budget_trial"));
  EXPECT_EQ(file("run.json")["request"]["training"]["steps"], "60");
  const std::string words = file("report.json")["settings_reason"];
  EXPECT_NE(words.find("252 x 189 pixels, --preset standard"), std::string::npos) << words;

  const std::string model = test::read_bytes(out() / "model/gaussians.ply");
  fs::remove(out() / "report.html");
  fs::create_directory(out() / "budget_trial");  // as a start leaves it that was killed
  const auto again = run("10h", "-w");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_FALSE(fs::exists(out() / "budget_trial"));
  EXPECT_EQ(file("budget.json"), chosen);
  EXPECT_TRUE(fs::exists(out() / "report.html"));
  EXPECT_EQ(test::read_bytes(out() / "model/gaussians.ply"), model);

  const std::string record = test::read_bytes(out() / "run.json");
  const auto other = run("9h");
  EXPECT_EQ(other.exit_code, 2) << other.err;
  EXPECT_NE(other.err.find("holds the results of another run"), std::string::npos) << other.err;
  EXPECT_EQ(file("budget.json"), chosen);
  EXPECT_EQ(test::read_bytes(out() / "run.json"), record);
}

TEST_F(Budget, TooLittleTimeIsRefusedAndNothingStays) {
  make_capture(3);
  const auto result = run("1s");
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_NE(result.err.find("--budget 1 s is too short; the quickest setting, 168 x 126 pixels"),
            std::string::npos)
      << result.err;
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Budget, FilesOfOthersAreFoundBeforeAnythingIsTried) {
  make_capture(3);
  for (const char* name : {"report.html", "views/view_01.color.png"}) {
    test::write_bytes(out() / name, "mine");
    const auto result = run("10h");
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find(name + std::string(" but no run.json")), std::string::npos)
        << result.err;
    EXPECT_FALSE(fs::exists(out() / "budget.json"));
    fs::remove_all(out());
  }
}

TEST_F(Budget, WhatItChoosesMayNotBeStatedToo) {
  for (const char* stated :
       {"--downscale 2", "--preset draft", "--set steps=5", "--set steps=60"}) {
    const auto result = run("1h", stated);
    EXPECT_EQ(result.exit_code, 2) << stated << result.err;
    EXPECT_NE(result.err.find("--budget"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(out()));
  }
}

}  // namespace
}  // namespace cgs
