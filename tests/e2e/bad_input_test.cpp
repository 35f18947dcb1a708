// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/images/png.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

using test::ProgramResult;
using test::run_cgs;
using test::TempDir;

ColorImage textured_image(int shift) {
  ColorImage image(32, 24, Eigen::Vector3f::Zero());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float v = 0.5f + 0.4f * std::sin(0.9f * float(x + shift)) * std::cos(1.3f * float(y));
      image(x, y) = Eigen::Vector3f(v, 1 - v, 0.5f);
    }
  }
  return image;
}

std::string frame_json(const std::string& file, double x) {
  std::ostringstream text;
  text << R"({"file_path": ")" << file << R"(", "transform_matrix": [[1,0,0,)" << x
       << "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}";
  return text.str();
}

void write_transforms(const TempDir& dir, const std::vector<std::string>& frames) {
  std::string text =
      R"({"w": 32, "h": 24, "fl_x": 30, "fl_y": 30, "cx": 16, "cy": 12, "frames": [)";
  for (size_t i = 0; i < frames.size(); ++i) text += (i == 0 ? "" : ", ") + frames[i];
  test::write_bytes(dir / "scene/transforms.json", text + "]}");
}

// A readable scene of three views, before a test breaks it.
void write_scene(const TempDir& dir) {
  std::filesystem::create_directories(dir / "scene/images");
  std::vector<std::string> frames;
  for (int i = 0; i < 3; ++i) {
    const std::string name = "images/" + std::to_string(i) + ".png";
    write_png(dir / ("scene/" + name), textured_image(i));
    frames.push_back(frame_json(name, 0.1 * i));
  }
  write_transforms(dir, frames);
}

void cut(const std::filesystem::path& file, double keep) {
  const std::string bytes = test::read_bytes(file);
  test::write_bytes(file, bytes.substr(0, size_t(keep * double(bytes.size()))));
}

// Runs the scene and expects one line of complaint that holds `words`, and no output folder.
void expect_refused(const TempDir& dir, int exit_code, const std::vector<std::string>& words) {
  const ProgramResult result =
      run_cgs("run " + (dir / "scene").string() + " -q -o " + (dir / "out").string());
  EXPECT_EQ(result.exit_code, exit_code) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_EQ(result.err.rfind("cgs: ", 0), 0u) << result.err;
  for (const std::string& word : words) {
    EXPECT_NE(result.err.find(word), std::string::npos) << "no '" << word << "' in " << result.err;
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "out")) << "something was left behind";
}

TEST(BadInput, FusionOfASceneWithoutDepthOrOfAModelWithOptionsOfDepth) {
  const TempDir dir;
  write_scene(dir);
  const auto fuse = [&](const std::string& input, const std::string& more) {
    return run_cgs("fuse " + (dir / input).string() + more + " -q -o " +
                   (dir / "out.vdb").string());
  };
  const ProgramResult nowhere =
      run_cgs("fuse " + (dir / "scene").string() + " -q -o " + (dir / "no/out.vdb").string());
  EXPECT_EQ(nowhere.exit_code, 5) << nowhere.err << "before the scene is read";
  const ProgramResult none = fuse("scene", "");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_EQ(std::count(none.err.begin(), none.err.end(), '\n'), 1) << none.err;
  EXPECT_NE(none.err.find("MISSING"), std::string::npos) << none.err;
  EXPECT_NE(none.err.find("--depth"), std::string::npos) << none.err;
  test::write_bytes(dir / "model/gaussians.ply", "");
  const ProgramResult model = fuse("model", " --depth-scale 1000");
  EXPECT_EQ(model.exit_code, 2);
  EXPECT_NE(model.err.find("--depth-scale"), std::string::npos) << model.err;
  EXPECT_FALSE(std::filesystem::exists(dir / "out.vdb"));
}

TEST(BadInput, MissingFolder) {
  const TempDir dir;
  expect_refused(dir, 3, {"OPEN", "scene"});
}

TEST(BadInput, FolderOfNoKnownLayout) {
  const TempDir dir;
  test::write_bytes(dir / "scene/readme.txt", "hello");
  expect_refused(dir, 3, {"SCHEMA", "transforms.json"});
}

TEST(BadInput, OneView) {
  const TempDir dir;
  write_scene(dir);
  write_transforms(dir, {frame_json("images/0.png", 0)});
  expect_refused(dir, 3, {"EMPTY", "2"});
}

TEST(BadInput, EmptyImage) {
  const TempDir dir;
  write_scene(dir);
  test::write_bytes(dir / "scene/images/1.png", "");
  expect_refused(dir, 3, {"EMPTY", "1.png"});
}

TEST(BadInput, CutPng) {
  const TempDir dir;
  write_scene(dir);
  cut(dir / "scene/images/1.png", 0.6);
  expect_refused(dir, 3, {"TRUNCATED", "1.png"});
}

TEST(BadInput, CutJpeg) {
  const TempDir dir;
  write_scene(dir);
  test::write_bytes(dir / "scene/images/1.jpg", encode_jpeg(textured_image(1), 90));
  cut(dir / "scene/images/1.jpg", 0.9);
  write_transforms(dir, {frame_json("images/0.png", 0), frame_json("images/1.jpg", 0.1)});
  expect_refused(dir, 3, {"TRUNCATED", "1.jpg"});
}

// Depth of a sensor may tell the scale, so lengths are no mistake; the photographs are.
TEST(BadInput, LengthsOfPhotographsWithDepth) {
  const TempDir dir;
  std::filesystem::create_directories(dir / "scene/depth");
  const ColorImage blank(64, 48, Eigen::Vector3f::Constant(0.5f));
  for (const char* name : {"a.png", "b.png"}) write_png(dir / "scene" / name, blank);
  const auto run = [&] {
    return run_cgs("run " + (dir / "scene").string() + " -q --voxel-size 5mm -o " +
                   (dir / "out").string());
  };
  EXPECT_EQ(run().exit_code, 6);
  std::filesystem::remove(dir / "scene/depth");
  EXPECT_EQ(run().exit_code, 2);
}

TEST(BadInput, PathThatLeavesTheScene) {
  const TempDir dir;
  write_scene(dir);
  write_png(dir / "outside.png", textured_image(5));
  write_transforms(dir, {frame_json("images/0.png", 0), frame_json("../outside.png", 0.1)});
  expect_refused(dir, 3, {"PATH", "outside.png"});
}

TEST(BadInput, CutJson) {
  const TempDir dir;
  write_scene(dir);
  cut(dir / "scene/transforms.json", 0.8);
  expect_refused(dir, 3, {"SYNTAX", "transforms.json"});
}

TEST(BadInput, SameCameraCentre) {
  const TempDir dir;
  write_scene(dir);
  write_transforms(dir, {frame_json("images/0.png", 1), frame_json("images/1.png", 1)});
  expect_refused(dir, 3, {"VALUE", "baseline"});
}

// poses_bounds.npy of `rows` x `columns` float64 in NPY format 1.0: cameras side by side that look
// along -z, for pictures of 32 x 24.
std::string npy(int rows, int columns) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (" +
                       std::to_string(rows) + ", " + std::to_string(columns) + "), }";
  header.resize(117, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size());
  bytes += '\0';
  bytes += header;
  for (int row = 0; row < rows; ++row) {
    // Columns of the 3 x 5 block: down, right, backward, position, (height, width, focal).
    const std::array<double, 17> values = {
        0, 1, 0, 0.1 * row, 24, -1, 0, 0, 0, 32, 0, 0, 1, 0, 30, 1, 10};
    bytes.append(reinterpret_cast<const char*>(values.data()), size_t(columns) * sizeof(double));
  }
  return bytes;
}

void write_llff(const TempDir& dir, const std::string& poses) {
  for (int i = 0; i < 3; ++i) {
    std::filesystem::create_directories(dir / "scene/images");
    write_png(dir / ("scene/images/" + std::to_string(i) + ".png"), textured_image(i));
  }
  test::write_bytes(dir / "scene/poses_bounds.npy", poses);
}

TEST(BadInput, PosesOfTheWrongShape) {
  const TempDir dir;
  write_llff(dir, npy(3, 16));
  expect_refused(dir, 3, {"SCHEMA", "poses_bounds.npy", "17"});
}

TEST(BadInput, MorePosesThanImages) {
  const TempDir dir;
  write_llff(dir, npy(4, 17));
  expect_refused(dir, 3, {"MISMATCH", "4", "3"});
}

TEST(BadInput, CutPoses) {
  const TempDir dir;
  write_llff(dir, npy(3, 17).substr(0, 300));
  expect_refused(dir, 3, {"TRUNCATED", "poses_bounds.npy"});
}

TEST(Usage, MistakesEndWithExitCode2) {
  const TempDir dir;
  write_scene(dir);
  const std::string scene = (dir / "scene").string();
  const std::string out = " -o " + (dir / "out").string();
  EXPECT_EQ(run_cgs("run " + scene).exit_code, 2);
  EXPECT_EQ(run_cgs("fly").exit_code, 2);
  EXPECT_EQ(run_cgs("").err, "cgs: A subcommand is required; see cgs --help\n");
  EXPECT_EQ(run_cgs("fliter a b").err,
            "cgs: there is no command fliter (did you mean filter?); see cgs --help\n");
  EXPECT_EQ(run_cgs("measure a.ply --distnce 1").err,
            "cgs: measure does not take --distnce (did you mean --distance?); see cgs measure "
            "--help\n");
  EXPECT_EQ(run_cgs("run " + scene + out + " --views 0,9").exit_code, 2);
  EXPECT_EQ(run_cgs("run " + scene + out + " --downscale 0").exit_code, 2);
  EXPECT_EQ(run_cgs("run " + scene + out + " --assume-unit parsec").exit_code, 2);
  EXPECT_EQ(run_cgs("run " + scene + out + " --voxel-size 5mm").exit_code, 2);
  EXPECT_EQ(run_cgs("run " + scene + out + " --threads -1").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(dir / "out"));
}

// One colour: solving for the cameras would end with exit code 6, minutes later with real ones.
TEST(Usage, WhatPhotographsCannotHaveIsRefusedBeforeTheirCamerasAreSolvedFor) {
  const TempDir dir;
  std::filesystem::create_directories(dir / "photos");
  for (const char* name : {"photos/a.png", "photos/b.png"}) {
    write_png(dir / name, ColorImage(64, 48, Eigen::Vector3f::Constant(0.5f)));
  }
  const std::string run = "run " + (dir / "photos").string() + " -o " + (dir / "out").string();
  EXPECT_EQ(run_cgs(run).exit_code, 6);
  const ProgramResult view = run_cgs(run + " --views a.png,c");
  EXPECT_EQ(view.exit_code, 2) << view.err;
  EXPECT_NE(view.err.find("no view \"c\" among 2: a, b"), std::string::npos) << view.err;
  const ProgramResult length = run_cgs(run + " --voxel-size 5mm");
  EXPECT_EQ(length.exit_code, 2) << length.err;
  EXPECT_NE(length.err.find("the scale of this scene is unknown"), std::string::npos) << length.err;
  for (const auto& [words, told] :
       {std::pair(" --assume-unit banana", "banana"),
        std::pair(" --marker-size banana", "banana"),
        std::pair(" --up 0 0 0", "--up"),
        std::pair(" --known-distance a:1,2 c:3,4 1m", "no view \"c\" among 2: a, b"),
        std::pair(" --known-distance a:1,2 b:3 1m", "VIEW:X,Y"),
        std::pair(" --known-distance a:1,2 b:3,4 1", "unit")}) {
    const ProgramResult refused = run_cgs(run + words);
    EXPECT_EQ(refused.exit_code, 2) << words << refused.err;
    EXPECT_NE(refused.err.find(told), std::string::npos) << words << refused.err;
  }
  EXPECT_EQ(run_cgs(run + " --control-points " + (dir / "missing.csv").string()).exit_code, 3);
  const std::string photos = (dir / "photos").string();
  for (const std::string command : {"run ", "train ", "split "}) {
    const ProgramResult refused = run_cgs(command + photos + " -o " + (dir / "file/out").string());
    EXPECT_EQ(refused.exit_code, 6) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(dir / "file")) << "nothing came into it";
  }
  test::write_bytes(dir / "file", "");
  for (const std::string command : {"run ", "train ", "split "}) {
    const ProgramResult refused = run_cgs(command + photos + " -o " + (dir / "file/out").string());
    EXPECT_EQ(refused.exit_code, 5) << refused.err;
  }
  write_png(dir / "photos/b.png", ColorImage(32, 24, Eigen::Vector3f::Constant(0.5f)));
  const ProgramResult focal = run_cgs(run + " --focal 50");
  EXPECT_EQ(focal.exit_code, 2) << focal.err;
  EXPECT_NE(focal.err.find("a.png is 64 pixels long, b.png 32"), std::string::npos) << focal.err;
}

TEST(Output, StatesTheMemoryOfTheRunAndNotOfWhatStartedIt) {
  constexpr size_t kLarge = size_t{700} << 20;
  std::vector<char> large(kLarge, 1);
  const TempDir dir;
  write_scene(dir);
  const std::string out = (dir / "out").string();
  const ProgramResult run =
      run_cgs("run " + (dir / "scene").string() + " -q --threads 1 --set steps=0 -o " + out);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto record = nlohmann::json::parse(test::read_bytes(dir / "out/run.json"));
  for (const auto& [name, stage] : record["stages"].items()) {
    EXPECT_LT(stage["peak_memory"], kLarge) << name;
  }
  EXPECT_EQ(large.back(), 1);  // is there to the end
}

// Under names that a run writes to, and beside them.
TEST(Output, FilesOfOthersAreNotReplaced) {
  const TempDir dir;
  write_scene(dir);
  const std::string run =
      "run " + (dir / "scene").string() + " -q --set steps=0 -o " + (dir / "out").string();
  test::write_bytes(dir / "out/report.html", "mine");
  const ProgramResult result = run_cgs(run);
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_NE(result.err.find("report.html but no run.json"), std::string::npos) << result.err;
  EXPECT_EQ(test::read_bytes(dir / "out/report.html"), "mine");
  for (const char* name : {"out/mesh/watertight.blend", "out/web/asset.usdz"}) {
    test::write_bytes(dir / name, "mine");
  }
  const ProgramResult again = run_cgs(run + " -w");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(run_cgs(run + " -w --assume-unit cm").exit_code, 0);
  for (const char* name : {"out/mesh/watertight.blend", "out/web/asset.usdz"}) {
    EXPECT_TRUE(std::filesystem::exists(dir / name)) << name;
  }
}

// A folder whose name is not UTF-8, a photograph that is held out, and a mask that comes and goes.
TEST(Output, FilesAreFoundByTheSceneNotByWhatTheModelNoted) {
  const TempDir dir;
  write_scene(dir);
  const std::string folder = (dir /
                              "K\xfc"
                              "che")
                                 .string();
  std::filesystem::rename(dir / "scene", folder);
  const std::string run =
      "run " + folder + " -q --views 0,1 --set steps=0 -o " + (dir / "out").string();
  const auto evaluation = [&] {
    const ProgramResult result = run_cgs(run + " -w --json");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out)["evaluation"]["views"];
  };
  const auto plain = evaluation();
  ASSERT_EQ(plain.size(), 1u);
  EXPECT_FALSE(std::filesystem::is_empty(dir / "out/web"));
  const std::string holes = test::read_bytes(dir / "out/views/2.hole.png");
  MaskMap mask(32, 24, 1);
  std::fill(mask.data.begin(), mask.data.begin() + 32 * 12, uint8_t{0});
  std::filesystem::create_directories(folder + "/masks");
  write_png(folder + "/masks/2.png", mask);
  EXPECT_NE(evaluation(), plain);
  EXPECT_NE(test::read_bytes(dir / "out/views/2.hole.png"), holes);
  std::filesystem::remove(folder + "/masks/2.png");
  EXPECT_EQ(evaluation(), plain);
  EXPECT_EQ(test::read_bytes(dir / "out/views/2.hole.png"), holes);
}

TEST(Output, AModelIsReplacedOnlyWhenAskedForAndFramesOfOthersNever) {
  const TempDir dir;
  write_scene(dir);
  const std::string model = (dir / "model").string();
  const std::string train = "train " + (dir / "scene").string() + " -q --set steps=0 -o ";
  const ProgramResult too_small = run_cgs(train + model + " --memory-limit 50M");
  EXPECT_EQ(too_small.exit_code, 4);
  EXPECT_NE(too_small.err.find("'depth and Gaussians' needs about"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(model));
  EXPECT_EQ(run_cgs(train + model).exit_code, 0);
  const ProgramResult again = run_cgs(train + model);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("holds a finished model"), std::string::npos) << again.err;
  EXPECT_EQ(run_cgs(train + model + " -w").exit_code, 0);
  test::write_bytes(dir / "run.json", "{}");
  EXPECT_EQ(run_cgs(train + model + " -w").exit_code, 2) << "the model of a run";
  test::write_bytes(dir / "video/frame_0000.png", "mine");
  const std::string render =
      "render " + model + " --path between -q -o " + (dir / "video").string();
  const ProgramResult refused = run_cgs(render + " --frames 2");
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  std::filesystem::remove(dir / "video/frame_0000.png");
  test::write_bytes(dir / "video/frame_0123.png", "mine");
  EXPECT_EQ(run_cgs(render + " --frames 4").exit_code, 0);
  EXPECT_EQ(run_cgs(render + " --frames 2").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(dir / "video/frame_0003.png")) << "of the longer path";
  EXPECT_EQ(test::read_bytes(dir / "video/frame_0123.png"), "mine");
}

TEST(Output, AFolderThatCannotBeMadeEndsWithExitCode5) {
  const TempDir dir;
  write_scene(dir);
  test::write_bytes(dir / "file", "in the way");
  const ProgramResult result =
      run_cgs("run " + (dir / "scene").string() + " -q -o " + (dir / "file").string());
  EXPECT_EQ(result.exit_code, 5) << result.err;
}

// "  name    what it does", below a heading.
std::vector<std::string> commands_of_help() {
  std::istringstream lines(run_cgs("--help").out);
  std::vector<std::string> out;
  std::string line;
  while (std::getline(lines, line) && line != "Subcommands:") {
  }
  while (std::getline(lines, line) && !line.empty()) {
    const bool is_name = line.size() > 2 && line.starts_with("  ") && line[2] != ' ';
    if (is_name) out.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return out;
}

TEST(Help, EveryCommandEndsWithAWorkedExample) {
  const std::vector<std::string> commands = commands_of_help();
  EXPECT_GE(commands.size(), 15u);
  for (const std::string& command : commands) {
    const ProgramResult result = run_cgs(command + " --help");
    EXPECT_EQ(result.exit_code, 0) << command;
    EXPECT_NE(result.out.find("Example: cgs " + command), std::string::npos) << command;
  }
}

TEST(Flags, UnderscoresAndDashesAreTheSame) {
  const TempDir dir;
  write_scene(dir);
  const ProgramResult result =
      run_cgs("info " + (dir / "scene").string() + " --allow_external --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("\"kind\""), std::string::npos);
}

}  // namespace
}  // namespace cgs
