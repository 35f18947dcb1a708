// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_files.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/bytes/atomic_file.h"
#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::run_files_test {
namespace {

using Names = std::vector<std::string>;

void write_files(const std::filesystem::path& folder, const Names& names) {
  for (const std::string& name : names) {
    std::filesystem::create_directories((folder / name).parent_path());
    write_file(folder / name, name);
  }
}

const StageFiles& files_of(const std::vector<StageFiles>& stages, Stage stage) {
  return stages.at(static_cast<size_t>(stage));
}

// Three stages, of which the second writes anew what the first wrote.
const std::vector<StageFiles> kStages = {{Stage::Model, {"model/a"}},
                                         {Stage::Scale, {}, {"model/a"}},
                                         {Stage::Web, {"web/b"}, {"web/b.*.jpg"}}};

TEST(NamedOutputs, AreFilesOfTheseNamesAndNothingElse) {
  const test::TempDir dir;
  write_files(dir.path(), {"web/lod1.glb", "web/lod.glb", "web/lod.old", "web/deep/lod2.glb"});
  std::filesystem::create_directory(dir / "web/lod3.glb");
  std::filesystem::create_symlink(dir / "web/lod.old", dir / "web/lod4.glb");
  EXPECT_EQ(named_outputs(dir.path(), {"web/lod*.glb", "web/absent", "absent/*"}),
            Names{"web/lod1.glb"});
  // Both ends of a name count, and they may not overlap.
  write_files(dir.path(), {"aba", "abba"});
  EXPECT_TRUE(named_outputs(dir.path(), {"ab*ba"}).empty());
}

TEST(StageFiles, AreThoseOfTheViewsAndLevelsOfARun) {
  Scene scene;
  for (const char* name : {"first", "second", "third", "fourth"}) {
    scene.views.emplace_back().name = name;
  }
  scene.input = {2, 0};
  scene.held_out = {1};
  const std::vector<StageFiles> stages = stage_files(scene, 2);
  EXPECT_EQ(files_of(stages, Stage::Model).files,
            (Names{"model/gaussians.ply",
                   "model/cameras.json",
                   "model/priors/third.exr",
                   "model/priors/first.exr"}));
  const Names& views = files_of(stages, Stage::Views).files;
  EXPECT_EQ(views.size(), 15u);
  EXPECT_EQ(views.front(), "views/first.exr");
  EXPECT_EQ(views.back(), "views/third.hole.png");
  EXPECT_TRUE(files_of(stages, Stage::Web).all().contains("web/asset.lod2.glb"));
  EXPECT_FALSE(files_of(stage_files(scene, 0), Stage::Web).all().contains("web/asset.lod2.glb"));
}

TEST(RefuseForeignFiles, UnlessARunWroteThere) {
  const test::TempDir dir;
  EXPECT_NO_THROW(refuse_foreign_files(dir / "absent", kStages));
  write_files(dir.path(), {"web/mine.jpg"});
  EXPECT_NO_THROW(refuse_foreign_files(dir.path(), kStages));
  write_files(dir.path(), {"web/b.0.jpg"});
  EXPECT_THROW(refuse_foreign_files(dir.path(), kStages), InvalidInput);
  write_files(dir.path(), {"run.json"});
  EXPECT_NO_THROW(refuse_foreign_files(dir.path(), kStages));
}

TEST(EarlierOutputs, AreWhatAStageMayWriteAnew) {
  const test::TempDir dir;
  write_files(dir.path(), {"model/a", "model/c", "web/b"});
  RunRecord record(dir.path(), {}, false);
  record.finish("model", 1, nullptr, {"model/a", "model/c"});
  const auto earlier = [&](size_t stage) {
    return earlier_outputs(kStages[stage], kStages, record, dir.path());
  };
  EXPECT_TRUE(earlier(0).empty());
  EXPECT_EQ(earlier(1), output_hashes(dir.path(), {"model/a"}));
  EXPECT_TRUE(earlier(2).empty());
}

TEST(RemoveOutputsAfter, LeavesWhatNoStageIsKnownToHaveWritten) {
  const test::TempDir dir;
  write_files(dir.path(), {"model/a", "web/b", "web/b.0.jpg", "web/b.mine.jpg"});
  RunRecord record(dir.path(), {}, false);
  record.finish("model", 1, nullptr, {"model/a"});
  record.finish("web", 1, nullptr, {"web/b", "web/b.0.jpg"});
  remove_outputs_after(Stage::Web, kStages, record, dir.path());
  EXPECT_TRUE(std::filesystem::exists(dir / "web/b"));
  remove_outputs_after(Stage::Model, kStages, record, dir.path());
  EXPECT_TRUE(std::filesystem::exists(dir / "model/a")) << "a later stage writes it anew";
  EXPECT_FALSE(std::filesystem::exists(dir / "web/b"));
  EXPECT_FALSE(std::filesystem::exists(dir / "web/b.0.jpg"));
  EXPECT_TRUE(std::filesystem::exists(dir / "web/b.mine.jpg"));
}

}  // namespace
}  // namespace cgs::run_files_test
