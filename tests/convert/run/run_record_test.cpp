// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_record.h"

#include <cstdio>
#include <fstream>

#include <gtest/gtest.h>

#include "io/bytes/atomic_file.h"
#include "io/bytes/content_hash.h"
#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::run_record_test {
namespace {

using Json = nlohmann::ordered_json;

TEST(RunRecord, AStageIsDoneOnceFinishedAndItsFilesAreThere) {
  const test::TempDir dir;
  RunRecord record(dir.path(), {{"scene", "a"}}, false);
  EXPECT_FALSE(record.is_done("model", {}));
  record.finish("model", 1.5, {{"gaussians", 7}});
  EXPECT_TRUE(record.is_done("model", {}));
  EXPECT_FALSE(record.is_done("model", {"gaussians.ply"}));
  write_file(dir / "gaussians.ply", "ply");
  EXPECT_TRUE(record.is_done("model", {"gaussians.ply"}));
}

TEST(RunRecord, AStageIsDoneWhileWhatItWroteIsThere) {
  const test::TempDir dir;
  write_file(dir / "splats.glb", "glb");
  write_file(dir / "splats.spz", "spz");
  RunRecord(dir.path(), {}, false).finish("splats", 1, nullptr, {"splats.glb", "splats.spz"});
  EXPECT_TRUE(RunRecord(dir.path(), {}, false).is_done("splats", {"splats.glb"}));
  std::filesystem::remove(dir / "splats.spz");
  EXPECT_FALSE(RunRecord(dir.path(), {}, false).is_done("splats", {"splats.glb"}));
}

TEST(RunRecord, KnowsWhatSomebodyChanged) {
  const test::TempDir dir;
  RunRecord record(dir.path(), {}, false);
  for (const char* name : {"model.ply", "cameras.json", "asset.glb"}) write_file(dir / name, "a");
  record.finish("model", 1, nullptr, {"model.ply", "cameras.json"});
  EXPECT_TRUE(record.changed_files("model").empty());
  write_file(dir / "cameras.json", "b");
  EXPECT_EQ(record.changed_files("model"), std::vector<std::string>{"cameras.json"});
  record.finish(
      "scale", 1, nullptr, {"cameras.json"});  // a stage may write those of an earlier one
  EXPECT_TRUE(record.changed_files("model").empty());
  EXPECT_EQ(record.files("model").size(), 2u);
  EXPECT_TRUE(record.files("scale").empty());
  record.finish("web", 1, nullptr, {"asset.glb"});
  const Json before = record.file_hashes();
  EXPECT_EQ(before.size(), 3u);
  std::ofstream(dir / "asset.glb").flush();  // empty now
  const RunRecord again(dir.path(), {}, false);
  EXPECT_EQ(again.changed_files("web"), std::vector<std::string>{"asset.glb"});
  EXPECT_EQ(again.file_hashes(), before);
}

TEST(RunRecord, SurvivesReopening) {
  const test::TempDir dir;
  RunRecord(dir.path(), {{"scene", "a"}}, false).finish("model", 1, {{"gaussians", 7}});
  const RunRecord again(dir.path(), {{"scene", "a"}}, false);
  EXPECT_EQ(again.result("model")["gaussians"], 7);
}

TEST(RunRecord, RefusesAnotherRequestAndNamesTheDifference) {
  const test::TempDir dir;
  const RunRecord first(dir.path(), {{"scene", "a"}, {"views", "1,2"}}, false);
  try {
    const RunRecord second(dir.path(), {{"scene", "a"}, {"views", "1,3"}}, false);
    FAIL() << "was accepted";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("views"), std::string::npos);
    EXPECT_EQ(std::string(error.what()).find("scene,"), std::string::npos);
  }
}

TEST(RunRecord, OverwriteForgetsTheOldStages) {
  const test::TempDir dir;
  RunRecord(dir.path(), {{"views", "1,2"}}, false).finish("model", 1, nullptr);
  const RunRecord record(dir.path(), {{"views", "1,3"}}, true);
  EXPECT_FALSE(record.is_done("model", {}));
}

TEST(RunRecord, OverwriteKeepsTheStagesAnotherAnswerDoesNotChange) {
  const test::TempDir dir;
  const Json request = {{"views", "1,2"}, {"voxel_size", ""}, {"max_error", ""}};
  {
    RunRecord record(dir.path(), request, false);
    for (const char* stage : {"model", "mesh", "web"}) record.finish(stage, 1, nullptr);
  }
  const std::map<std::string, std::string> decides = {{"voxel_size", "mesh"}, {"max_error", "web"}};
  Json changed = request;
  changed["max_error"] = "1mm";
  EXPECT_THROW(RunRecord(dir.path(), changed, false, decides), InvalidInput);
  {
    const RunRecord record(dir.path(), changed, true, decides);
    EXPECT_TRUE(record.is_done("mesh", {}));
    EXPECT_FALSE(record.is_done("web", {}));
  }
  changed["voxel_size"] = "1cm";
  changed["max_error"] = "2mm";
  {
    const RunRecord record(dir.path(), changed, true, decides);
    EXPECT_TRUE(record.is_done("model", {}));
    EXPECT_FALSE(record.is_done("mesh", {}));
  }
  changed["views"] = "1,3";
  const RunRecord record(dir.path(), changed, true, decides);
  EXPECT_FALSE(record.is_done("model", {}));
}

TEST(RunRecord, OverwriteRemovesTheFilesOfWhatItForgets) {
  const test::TempDir dir;
  for (const char* name : {"a.ply", "b.glb", "c.txt"}) write_file(dir / name, "of a stage");
  write_file(dir.path().parent_path() / "outside.txt", "of somebody else");
  {
    RunRecord record(dir.path(), {{"views", "1"}, {"size", 1}}, false);
    record.finish("model", 1, nullptr, {"a.ply"});
    record.finish("web", 1, nullptr, {"b.glb", "../outside.txt"});
  }
  const std::map<std::string, std::string> decides = {{"size", "web"}};
  const RunRecord record(dir.path(), {{"views", "1"}, {"size", 2}}, true, decides);
  EXPECT_TRUE(std::filesystem::exists(dir / "a.ply"));
  EXPECT_FALSE(std::filesystem::exists(dir / "b.glb"));
  EXPECT_TRUE(std::filesystem::exists(dir / "c.txt"));
  EXPECT_TRUE(std::filesystem::remove(dir.path().parent_path() / "outside.txt"));
}

TEST(RunRecord, RefusesStagesWhoseFilesAreNone) {
  const test::TempDir dir;
  write_file(dir / "run.json",
             R"({"request":{},"stages":{"model":{"seconds":1,"peak_memory":1,"result":1,)"
             R"("files":[7]}}})");
  EXPECT_TRUE(read_run_record(dir / "run.json").is_null());
}

TEST(RunRecord, RunningAStageAgainForgetsWhatFollowed) {
  const test::TempDir dir;
  RunRecord record(dir.path(), {}, false);
  record.finish("model", 1, nullptr);
  record.finish("mesh", 1, nullptr);
  record.finish("model", 1, nullptr);
  EXPECT_TRUE(record.is_done("model", {}));
  EXPECT_FALSE(record.is_done("mesh", {}));
}

TEST(RunRecord, ACutFileCountsAsAnotherRun) {
  const test::TempDir dir;
  write_file(dir / "run.json", "{\"request\":");
  EXPECT_THROW(RunRecord(dir.path(), {}, false), InvalidInput);
  EXPECT_NO_THROW(RunRecord(dir.path(), {}, true));
}

TEST(ContentHash, IsFnv1aOfTheBytes) {
  const test::TempDir dir;
  write_file(dir / "a", "a");
  EXPECT_EQ(file_hash(dir / "a"), "af63dc4c8601ec8c");  // published FNV-1a test vector
  std::ofstream(dir / "empty").flush();
  EXPECT_EQ(file_hash(dir / "empty"), "cbf29ce484222325");
  const std::string large(3'000'001, 'x');  // read in parts
  write_file(dir / "large", large);
  char expected[17];
  std::snprintf(
      expected, sizeof expected, "%016llx", static_cast<unsigned long long>(content_hash(large)));
  EXPECT_EQ(file_hash(dir / "large"), expected);
}

}  // namespace
}  // namespace cgs::run_record_test
