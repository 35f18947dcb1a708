// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/tradeoff_design.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::tradeoff_design_test {
namespace {

bool same_model(const Setting& a, const Setting& b) {
  return a.coarser == b.coarser && a.steps == b.steps && a.repeat == b.repeat;
}
bool same_mesh(const Setting& a, const Setting& b) {
  return same_model(a, b) && a.voxel == b.voxel && a.simplify == b.simplify;
}

TEST(TradeoffDesign, SharesAStageExactlyWhereAllBeforeItIsEqual) {
  const std::vector<Setting> design = tradeoff_design();
  for (const Setting& a : design) {
    for (const Setting& b : design) {
      EXPECT_EQ(model_key(a) == model_key(b), same_model(a, b)) << label(a) << " / " << label(b);
      EXPECT_EQ(mesh_key(a) == mesh_key(b), same_mesh(a, b)) << label(a) << " / " << label(b);
      EXPECT_EQ(asset_key(a) == asset_key(b), a == b) << label(a) << " / " << label(b);
      EXPECT_EQ(label(a) == label(b), a == b) << label(a) << " / " << label(b);
    }
  }
}

TEST(TradeoffDesign, TurnsEachThingByItselfAndDoesTheWorkOnce) {
  const std::vector<Setting> design = tradeoff_design();
  EXPECT_EQ(design.front(), Setting());
  const auto has = [&](const Setting& s) {
    return std::find(design.begin(), design.end(), s) != design.end();
  };
  for (const int coarser : {2, 4}) EXPECT_TRUE(has({.coarser = coarser}));
  for (const int steps : {0, 20, 120, 240}) EXPECT_TRUE(has({.steps = steps}));
  for (const double voxel : {0.7, 1.5, 2.0}) EXPECT_TRUE(has({.voxel = voxel}));
  for (const double error : {0.0, 0.5, 1.0}) EXPECT_TRUE(has({.simplify = error}));
  for (const double error : {0.1, 0.4}) EXPECT_TRUE(has({.max_error = error}));
  for (const int repeat : {1, 2}) EXPECT_TRUE(has({.repeat = repeat}));
  std::set<std::string> models;
  std::set<std::string> meshes;
  for (const Setting& s : design) {
    models.insert(model_key(s));
    meshes.insert(mesh_key(s));
  }
  EXPECT_LE(models.size(), design.size() / 2);
  EXPECT_LT(meshes.size(), design.size());
}

TEST(TradeoffDesign, StartsFromTheDefaultsOfARun) {
  EXPECT_EQ(Setting().steps, training_preset("standard").steps);
  RunRequest standard;
  standard.scene.path = "photos";
  const RunRequest same = request_of({}, standard, 3, 0);
  EXPECT_EQ(same.training.steps, standard.training.steps);
  EXPECT_EQ(same.voxel_size + same.simplify + same.compression_error, "");
  EXPECT_EQ(same.scene.options.downscale, 3);
}

TEST(TradeoffDesign, LengthsArePartsOfTheStandardVoxel) {
  const RunRequest r =
      request_of({.coarser = 2, .voxel = 1.5, .simplify = 0.5, .max_error = 0.1}, {}, 3, 0.02);
  EXPECT_EQ(r.scene.options.downscale, 6);
  EXPECT_DOUBLE_EQ(std::stod(r.voxel_size), 2 * 1.5 * 0.02);
  EXPECT_DOUBLE_EQ(std::stod(r.simplify), 0.01);
  EXPECT_DOUBLE_EQ(std::stod(r.compression_error), 0.002);
  EXPECT_EQ(request_of({.simplify = 0}, {}, 1, 0).simplify, "0");
  EXPECT_THROW(request_of({.voxel = 2}, {}, 1, 0), InvalidInput);
}

// What a shell makes of a line, a word per line.
std::string words(const std::string& line) {
  const test::TempDir dir;
  const std::string command =
      "for word in " + line + "; do printf '%s\\n' \"$word\"; done >" + (dir / "out").string();
  EXPECT_EQ(std::system(command.c_str()), 0);
  return test::read_bytes(dir / "out");
}

TEST(CommandLine, SurvivesAShell) {
  RunRequest r = request_of({.steps = 20, .voxel = 2}, {}, 2, 0.5);
  r.scene.path = "my photos/it's $HOME; #1";
  r.scene.options.views = "1,10,19";
  r.scene.assume_unit = "m";
  r.scene.up = {0, -1, 0.5};
  r.output = "out/a b";
  EXPECT_EQ(words(command_line(r)),
            "cgs\nrun\nmy photos/it's $HOME; #1\n--views\n1,10,19\n--downscale\n2\n--assume-unit\n"
            "m\n--up\n0\n-1\n0.5\n--preset\ndraft\n--voxel-size\n1\n-o\nout/a b\n");
  r.training.steps = 120;
  EXPECT_NE(command_line(r).find(" --preset fine"), std::string::npos);
  r.training.steps = 240;
  EXPECT_NE(command_line(r).find("--set steps=240"), std::string::npos);
  EXPECT_EQ(command_line(r).find("--refine-poses"), std::string::npos);
  r.scene.refine_poses = true;
  EXPECT_NE(command_line(r).find(" --refine-poses"), std::string::npos);
  r.memory_limit = 1 << 20;
  EXPECT_NE(command_line(r, 3).find(" --memory-limit 1048576 --threads 3 -o"), std::string::npos);
}

TEST(CommandLine, HasEveryOptionThatTheSceneWasOpenedWith) {
  RunRequest r = request_of({}, {}, 2, 0.5);
  r.scene.path = "photos";
  r.scene.options.chunk = "left";
  r.scene.options.allow_external = true;
  r.scene.focal = 812.25;
  r.scene.options.depth = {"my depth", DepthKind::Relative, "", 0};
  r.output = "out";
  EXPECT_EQ(words(command_line(r)),
            "cgs\nrun\nphotos\n--downscale\n2\n--depth\nmy depth\n--depth-kind\ndepth\n"
            "--chunk\nleft\n--allow-external\n--focal\n812.25\n-o\nout\n");
  r.scene.options.depth = {"", DepthKind::Disparity, "net it's.onnx", 0};
  EXPECT_NE(words(command_line(r)).find("--depth-kind\ndisparity\n--depth-model\nnet it's.onnx\n"),
            std::string::npos);
  r.scene.options.depth = {"tum", DepthKind::Metric, "", 5000.1};
  EXPECT_NE(
      words(command_line(r)).find("--depth\ntum\n--depth-kind\nmetric\n--depth-scale\n5000.1\n"),
      std::string::npos);
}

}  // namespace
}  // namespace cgs::tradeoff_design_test
