// SPDX-License-Identifier: GPL-3.0-or-later
//
// `cgs run --preview`: a first look, and nothing of the run itself.
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

TEST(Preview, ExcludesWhatItChooses) {
  const TempDir dir;
  const test::ProgramResult run = preview(dir / "out", " --downscale 2");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--preview"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(dir / "out"));
}

}  // namespace
}  // namespace cgs::e2e_preview_test
