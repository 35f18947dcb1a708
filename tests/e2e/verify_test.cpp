// SPDX-License-Identifier: GPL-3.0-or-later
// The same photographs give the same files for any number of threads, and `cgs verify` notices when
// an input or an output of a run is not what it was.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/e2e/extremes/cell.h"

namespace cgs::test {
namespace {

namespace fs = std::filesystem;

std::string run_arguments(const fs::path& scene, const fs::path& out) {
  return "run " + scene.string() + " --views " + kInputViews +
         " --assume-unit m --set steps=20 -q -o " + out.string();
}

// Content of every file by its path; times and memory are not results.
std::map<std::string, std::string> results_in(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = fs::relative(entry.path(), folder).string();
    const bool states_times = name == "run.json" || name == "report.json" || name == "report.html";
    if (entry.is_regular_file() && !states_times) out[name] = read_bytes(entry.path());
  }
  return out;
}

// 64-bit FNV-1a, as 16 hexadecimal digits.
std::string fnv1a(const std::string& bytes) {
  uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  std::ostringstream text;
  text << std::hex << std::setw(16) << std::setfill('0') << hash;
  return text.str();
}

class Verify : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    dir_ = new TempDir;
    write_scene(scene(), {1, Eigen::Vector3d::Zero(), "plain"});
    const auto result = run_cgs(run_arguments(scene(), out()) + " --threads 2");
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  static void TearDownTestSuite() { delete dir_; }

  static fs::path scene() { return *dir_ / "scene"; }
  static fs::path out() { return *dir_ / "out"; }
  static ProgramResult verify() { return run_cgs("verify " + out().string()); }

  /// Changes a file, says what verify says, and puts it back.
  static ProgramResult verify_with(const fs::path& file, const std::string& content) {
    const std::string before = read_bytes(file);
    write_bytes(file, content);
    ProgramResult result = verify();
    write_bytes(file, before);
    return result;
  }

  static TempDir* dir_;
};
TempDir* Verify::dir_ = nullptr;

TEST_F(Verify, InfoTellsOfEveryAssetOfARunAndOfTheRun) {
  const std::map<std::string, std::string> kinds = {{".vdb", "volume"},
                                                    {".exr", "raster"},
                                                    {".spz", "splats"},
                                                    {".obj", "mesh"},
                                                    {".stl", "mesh"},
                                                    {".3mf", "mesh"},
                                                    {".ply", ""},
                                                    {".glb", ""}};
  std::set<std::string> told;
  for (const auto& [name, bytes] : results_in(out())) {
    const auto kind = kinds.find(fs::path(name).extension());
    if (kind == kinds.end()) continue;
    const auto info = run_cgs("info " + (out() / name).string() + " --json");
    ASSERT_EQ(info.exit_code, 0) << name << ": " << info.err;
    const auto json = nlohmann::json::parse(info.out);
    if (!kind->second.empty()) EXPECT_EQ(json["kind"], kind->second) << name;
    if (kind->first == ".vdb") EXPECT_EQ(json["units"], "m");
    told.insert(kind->first);
  }
  EXPECT_EQ(told.size(), kinds.size());
  const auto run = nlohmann::json::parse(run_cgs("info " + out().string() + " --json").out);
  EXPECT_EQ(run["kind"], "run");
  EXPECT_TRUE(run["finished"]);
  EXPECT_GT(run["stages"].size(), 4u);
  const std::string model = (out() / "model").string();
  EXPECT_EQ(nlohmann::json::parse(run_cgs("info " + model + " --json").out)["kind"], "splats");
}

/// A setting of the environment while it lives.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) { ::setenv(name, value, 1); }
  ~Environment() { ::unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
};

TEST_F(Verify, AnyThreadsAnyRepetitionAndAnyPathOfTheLibrariesGiveTheSameFiles) {
  const auto expected = results_in(out());
  EXPECT_GE(expected.size(), 100u);
  std::map<std::string, std::set<std::string>> contents;
  for (const auto& [name, bytes] : expected) contents[name].insert(fnv1a(bytes));
  int runs = 1;
  const auto run_again = [&](int threads) {
    const fs::path again = *dir_ / ("run_" + std::to_string(runs++));
    const auto result =
        run_cgs(run_arguments(scene(), again) + " --threads " + std::to_string(threads));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (const auto& [name, bytes] : results_in(again)) contents[name].insert(fnv1a(bytes));
    EXPECT_EQ(run_cgs("verify " + out().string() + " " + again.string()).exit_code, 0);
    fs::remove_all(again);
  };
  for (const int threads : {1, 2, 3, 4}) run_again(threads);
  {
    // glibc and OpenCV choose among functions by what the processor has; these are of older ones.
    const Environment glibc("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-AVX512F");
    const Environment opencv("OPENCV_CPU_DISABLE", "AVX2");
    run_again(2);
  }
  size_t most = 0;
  for (const auto& [name, hashes] : contents) {
    EXPECT_EQ(hashes.size(), 1u) << name;
    most = std::max(most, hashes.size());
  }
  std::printf("hashes: at most %zu per file, %d runs of %zu files\n", most, runs, contents.size());
  EXPECT_EQ(contents.size(), expected.size());
}

TEST_F(Verify, FindsNothingWhereNothingChanged) {
  const auto result = verify();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("25 inputs"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find(" 0 differ"), std::string::npos) << result.out;
}

TEST_F(Verify, NamesTheOutputThatChangedOrIsMissing) {
  std::string glb = read_bytes(out() / "web/asset.glb");
  glb[glb.size() / 2] = char(glb[glb.size() / 2] ^ 1);
  const auto changed = verify_with(out() / "web/asset.glb", glb);
  EXPECT_EQ(changed.exit_code, 3);
  EXPECT_NE(changed.out.find("web/asset.glb: changed"), std::string::npos) << changed.out;
  EXPECT_NE(changed.err.find("MISMATCH"), std::string::npos) << changed.err;

  fs::rename(out() / "volume.vdb", *dir_ / "volume.vdb");
  const auto missing = verify();
  fs::rename(*dir_ / "volume.vdb", out() / "volume.vdb");
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.out.find("volume.vdb: missing"), std::string::npos) << missing.out;
  EXPECT_EQ(verify().exit_code, 0);
}

TEST_F(Verify, NamesTheInputThatChanged) {
  const auto photograph =
      verify_with(scene() / "images/v12.png", read_bytes(scene() / "images/v11.png"));
  EXPECT_EQ(photograph.exit_code, 3);
  EXPECT_NE(photograph.out.find("input v12: changed"), std::string::npos) << photograph.out;

  const auto cameras = verify_with(scene() / "transforms.json", [] {
    auto json = nlohmann::json::parse(read_bytes(scene() / "transforms.json"));
    json["fl_x"] = 70.001;
    return json.dump();
  }());
  EXPECT_EQ(cameras.exit_code, 3);
  EXPECT_NE(cameras.out.find("input cameras: changed"), std::string::npos) << cameras.out;
  EXPECT_EQ(verify().exit_code, 0);
}

TEST_F(Verify, NamesTheMaskOfAHeldOutPhotographThatIsNew) {
  fs::create_directories(scene() / "masks");
  fs::copy_file(scene() / "images/v21.png", scene() / "masks/v21.png");
  const auto masked = verify();
  fs::remove_all(scene() / "masks");
  EXPECT_EQ(masked.exit_code, 3);
  EXPECT_NE(masked.out.find("input v21, mask: new"), std::string::npos) << masked.out;
}

TEST_F(Verify, ARunAgainBringsBackWhatIsMissing) {
  const fs::path copy = *dir_ / "copy";
  for (const char* name : {"mesh/watertight.stl", "web/splats.spz", "mesh/watertight.v11.jpg"}) {
    fs::copy(out(), copy, fs::copy_options::recursive);
    ASSERT_TRUE(fs::remove(copy / name)) << name;
    const auto again = run_cgs(run_arguments(scene(), copy));
    EXPECT_EQ(again.exit_code, 0) << again.err;
    EXPECT_TRUE(results_in(copy) == results_in(out())) << name;
    EXPECT_EQ(run_cgs("verify " + copy.string()).exit_code, 0);
    fs::remove_all(copy);
  }
}

// What a run goes on from may have been changed since: it stays, is told, and verify still knows.
TEST_F(Verify, KnowsWhatWasChangedBeforeARunWentOn) {
  const fs::path copy = *dir_ / "copy";
  fs::copy(out(), copy, fs::copy_options::recursive);
  write_bytes(copy / "views/v11.color.png", "of somebody else");
  write_bytes(copy / "web/splats.glb", "");
  write_bytes(copy / "mesh/watertight.mine.jpg", "of the user");
  fs::remove(copy / "mesh/watertight.stl");
  const auto again = run_cgs(run_arguments(scene(), copy));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  for (const char* name : {"views/v11.color.png", "web/splats.glb"}) {
    EXPECT_NE(again.err.find(std::string(name) + " is not what the run wrote"), std::string::npos)
        << again.err;
  }
  EXPECT_EQ(read_bytes(copy / "mesh/watertight.mine.jpg"), "of the user");
  const auto verified = run_cgs("verify " + copy.string());
  EXPECT_EQ(verified.exit_code, 3);
  for (const char* name : {"views/v11.color.png", "web/splats.glb"}) {
    EXPECT_NE(verified.out.find(std::string(name) + ": changed"), std::string::npos)
        << verified.out;
  }
  EXPECT_NE(verified.out.find(" 2 differ"), std::string::npos) << verified.out;
  fs::remove_all(copy);
}

// The stage of the scale may write the model anew, and here has no reason to.
TEST_F(Verify, KnowsThatTheModelWasChangedBeforeItsScaleWasToldAgain) {
  const fs::path copy = *dir_ / "copy";
  fs::copy(out(), copy, fs::copy_options::recursive);
  std::string splats = read_bytes(copy / "model/gaussians.ply");
  splats[splats.size() / 2] = char(splats[splats.size() / 2] ^ 1);
  write_bytes(copy / "model/gaussians.ply", splats);
  auto record = nlohmann::ordered_json::parse(read_bytes(copy / "run.json"));
  nlohmann::ordered_json stages;
  stages["model"] = record["stages"]["model"];  // as a run that was stopped after it
  record["stages"] = stages;
  write_bytes(copy / "run.json", record.dump());
  const auto again = run_cgs(run_arguments(scene(), copy));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const auto verified = run_cgs("verify " + copy.string());
  EXPECT_EQ(verified.exit_code, 3);
  EXPECT_NE(verified.out.find("model/gaussians.ply: changed"), std::string::npos) << verified.out;
  fs::remove_all(copy);
}

TEST_F(Verify, SeesWhatLiesBehindALinkedFolder) {
  const fs::path copy = *dir_ / "copy";
  const fs::path elsewhere = *dir_ / "elsewhere";
  fs::copy(out(), copy, fs::copy_options::recursive);
  fs::rename(copy / "web", elsewhere);
  fs::create_directory_symlink(elsewhere, copy / "web");
  fs::remove(copy / "web/splats.spz");
  const auto again = run_cgs(run_arguments(scene(), copy));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const std::string whole = run_cgs("verify " + copy.string()).out;
  EXPECT_EQ(whole, verify().out);
  write_bytes(copy / "web/asset.glb", "of somebody else");
  EXPECT_EQ(run_cgs("verify " + copy.string()).exit_code, 3);
  fs::remove_all(copy);
  fs::remove_all(elsewhere);
}

TEST_F(Verify, ListsOutputsWhereAPhotographIsGone) {
  fs::rename(scene() / "images/v11.png", *dir_ / "v11.png");
  const auto result = verify();
  fs::rename(*dir_ / "v11.png", scene() / "images/v11.png");
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_NE(result.out.find("input "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("outputs checked"), std::string::npos) << result.out;
}

TEST_F(Verify, OverwritingLeavesNothingOfWhatWasBefore) {
  const fs::path copy = *dir_ / "copy";
  fs::copy(out(), copy, fs::copy_options::recursive);
  write_bytes(copy / "remarks.txt", "of the user");
  const auto result = run_cgs("run " + scene().string() +
                              " --views v12,v13 --set steps=3 --overwrite -q -o " + copy.string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto outputs = nlohmann::json::parse(read_bytes(copy / "run.json"))["outputs"];
  for (const auto& [name, bytes] : results_in(copy)) {
    EXPECT_TRUE(outputs.contains(name) || name == "remarks.txt") << name;
  }
  EXPECT_FALSE(fs::exists(copy / "model/priors/v11.exr"));
  EXPECT_FALSE(fs::exists(copy / "mesh/watertight.stl"));  // of unknown scale now
  EXPECT_EQ(run_cgs("verify " + copy.string()).exit_code, 0);
  fs::remove_all(copy);
}

// A second run does nothing, so it must not vouch for what happened to the files since the first.
TEST_F(Verify, ARunThatDoesNothingLeavesTheHashes) {
  const std::string before = read_bytes(out() / "web/asset.glb");
  std::string glb = before;
  glb[glb.size() / 2] = char(glb[glb.size() / 2] ^ 1);
  write_bytes(out() / "web/asset.glb", glb);
  const auto again = run_cgs(run_arguments(scene(), out()));
  const auto changed = verify();
  write_bytes(out() / "web/asset.glb", before);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(changed.exit_code, 3) << changed.out;
  EXPECT_NE(changed.out.find("web/asset.glb: changed"), std::string::npos) << changed.out;
}

void write_depth(const fs::path& folder) {
  fs::create_directories(folder);
  for (const int v : {11, 12, 13}) {
    const DepthMap depth = true_depth_of(v);
    std::string pfm =
        "Pf\n" + std::to_string(depth.width) + " " + std::to_string(depth.height) + "\n-1\n";
    for (int y = depth.height - 1; y >= 0; --y) {
      const float* row = depth.data.data() + size_t(y) * size_t(depth.width);
      pfm.append(reinterpret_cast<const char*>(row), sizeof(float) * size_t(depth.width));
    }
    write_bytes(folder / ("v" + std::to_string(v) + ".pfm"), pfm);
  }
}

// Folders of runs without depth know nothing of it, whichever version wrote them.
TEST_F(Verify, TheRequestStatesDepthOnlyWhereThereIsSome) {
  const auto record = nlohmann::json::parse(read_bytes(out() / "run.json"));
  EXPECT_FALSE(record.at("request").contains("depth"));
}

TEST_F(Verify, FindsDepthThatWasGivenAndLeavesOutFilesOfTheUser) {
  const fs::path depth = *dir_ / "sensor/depths";
  write_depth(depth);
  const fs::path with_depth = *dir_ / "with_depth";
  fs::create_directories(with_depth);
  write_bytes(with_depth / "remarks.txt", "of the user");
  const std::string run = run_arguments(scene(), with_depth) + " --depth " + depth.string() +
                          " --depth-kind metric --depth-scale 1";
  const auto result = run_cgs(run);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  write_bytes(with_depth / "remarks.txt", "by the user");
  EXPECT_TRUE(
      nlohmann::json::parse(read_bytes(with_depth / "run.json"))["request"].contains("depth"));
  const auto same = run_cgs("verify " + with_depth.string());
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  EXPECT_NE(same.out.find("28 inputs"), std::string::npos) << same.out;

  // Depth in metres is brought into the scene by its unit: another one makes another model.
  const fs::path in_feet = *dir_ / "in_feet";
  fs::copy(with_depth, in_feet, fs::copy_options::recursive);
  const auto again = run_cgs("run " + scene().string() + " --views " + kInputViews +
                             " --assume-unit ft --set steps=20 --overwrite -o " + in_feet.string() +
                             " --depth " + depth.string() + " --depth-kind metric --depth-scale 1");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ((again.out + again.err).find("done before"), std::string::npos) << again.err;
  fs::remove_all(in_feet);

  // Confidence is read of Polycam's captures alone, so that here it is no input.
  fs::create_directories(*dir_ / "sensor/confidence");
  fs::copy_file(depth / "v12.pfm", *dir_ / "sensor/confidence/v12.pfm");
  const auto beside = run_cgs("verify " + with_depth.string());
  EXPECT_EQ(beside.exit_code, 0) << beside.out;
  EXPECT_NE(beside.out.find("28 inputs"), std::string::npos) << beside.out;
  fs::remove_all(*dir_ / "sensor/confidence");

  fs::copy_file(depth / "v11.pfm", depth / "v12.pfm", fs::copy_options::overwrite_existing);
  const auto changed = run_cgs("verify " + with_depth.string());
  EXPECT_EQ(changed.exit_code, 3);
  EXPECT_NE(changed.out.find("input v12, depth: changed"), std::string::npos) << changed.out;
}

TEST_F(Verify, RefusesWhatIsNoFinishedRun) {
  const auto none = run_cgs("verify " + scene().string());
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.err.find("MISSING"), std::string::npos) << none.err;
  for (const char* text : {"{}", "[1]", "nonsense", R"({"outputs":{},"request":[]})"}) {
    const auto result = verify_with(out() / "run.json", text);
    EXPECT_EQ(result.exit_code, 3) << text;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  // Names and values that no run writes.
  auto json = nlohmann::json::parse(read_bytes(out() / "run.json"));
  json["outputs"] = {{"../scene/transforms.json", 7}};
  EXPECT_EQ(verify_with(out() / "run.json", json.dump()).exit_code, 3);
}

// Hashes only tell that files are what they were; whether they are what the inputs lead to, doing
// it again tells.
TEST_F(Verify, RecomputesEverythingAndFindsAResultThatTheInputsDoNotLeadTo) {
  const std::string recompute = "verify " + out().string() + " --recompute";
  const auto same = run_cgs(recompute);
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  EXPECT_NE(same.out.find(" 0 differ"), std::string::npos) << same.out;
  EXPECT_FALSE(fs::exists(out() / "recomputed"));

  const std::string glb = read_bytes(out() / "web/asset.glb");
  const std::string record = read_bytes(out() / "run.json");
  std::string forged = glb;
  forged[forged.size() / 2] = char(forged[forged.size() / 2] ^ 1);
  write_bytes(out() / "web/asset.glb", forged);
  auto json = nlohmann::ordered_json::parse(record);
  json["outputs"]["web/asset.glb"] = fnv1a(forged);
  write_bytes(out() / "run.json", json.dump());
  EXPECT_EQ(verify().exit_code, 0);
  const auto found = run_cgs(recompute);
  write_bytes(out() / "web/asset.glb", glb);
  write_bytes(out() / "run.json", record);
  EXPECT_EQ(found.exit_code, 3) << found.out;
  EXPECT_NE(found.out.find("web/asset.glb: changed\n"), std::string::npos) << found.out;
  EXPECT_NE(found.out.find(" 1 differ\n"), std::string::npos) << found.out;
  EXPECT_TRUE(read_bytes(out() / "recomputed/web/asset.glb") == glb);

  // What was computed then is no witness today.
  write_bytes(out() / "recomputed/web/asset.glb", forged);
  write_bytes(out() / "web/asset.glb", forged);
  const auto again = run_cgs(recompute);
  write_bytes(out() / "web/asset.glb", glb);
  EXPECT_EQ(again.exit_code, 3) << again.out;
  EXPECT_NE(again.out.find("web/asset.glb: changed\n"), std::string::npos) << again.out;
  fs::remove_all(out() / "recomputed");
}

// Files that state times cannot be computed again, and are held against their hashes all the same.
TEST_F(Verify, RecomputingFindsAChangedPageToo) {
  const std::string page = read_bytes(out() / "report.html");
  write_bytes(out() / "report.html", page + " ");
  const auto found = run_cgs("verify " + out().string() + " --recompute -q --threads 1");
  write_bytes(out() / "report.html", page);
  EXPECT_EQ(found.exit_code, 3);
  EXPECT_NE(found.out.find("report.html: changed\n"), std::string::npos) << found.out;
  EXPECT_NE(found.out.find(" 1 differ\n"), std::string::npos) << found.out;
  fs::remove_all(out() / "recomputed");
}

// Everything a run can be asked for comes back from its record.
TEST_F(Verify, RecomputesARunOfManyOptions) {
  const fs::path many = *dir_ / "many";
  const auto result =
      run_cgs("run " + scene().string() + " --views " + kInputViews +
              " --known-distance v11:20,20 v12:40,20 1.2m+-1cm --up 0 0 1 "
              "--set steps=3 --set depth_spacing=64,16 --voxel-size 6cm "
              "--simplify 2cm --compression-error 1cm --glb-encoding meshopt --lods 1 "
              "--refine-poses --downscale 1 -q -o " +
              many.string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto same = run_cgs("verify " + many.string() + " --recompute");
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
}

TEST_F(Verify, DoesNotRecomputeFromOtherInputs) {
  const fs::path view = scene() / "images/v12.png";
  const std::string before = read_bytes(view);
  write_bytes(view, read_bytes(scene() / "images/v11.png"));
  const auto found = run_cgs("verify " + out().string() + " --recompute");
  write_bytes(view, before);
  EXPECT_EQ(found.exit_code, 3);
  EXPECT_NE(found.out.find("input v12: changed"), std::string::npos) << found.out;
  EXPECT_FALSE(fs::exists(out() / "recomputed"));
}

// Two runs are the same if their results are, and told apart otherwise.
TEST_F(Verify, ComparesTwoRuns) {
  const fs::path other = *dir_ / "other";
  const auto result = run_cgs(run_arguments(scene(), other) + " --set steps=21");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto compared = run_cgs("verify " + out().string() + " " + other.string() + " --json");
  EXPECT_EQ(compared.exit_code, 3);
  const auto report = nlohmann::json::parse(compared.out);
  bool names_splats = false;
  for (const std::string line : report["differing"]) {
    names_splats = names_splats || line == "model/gaussians.ply: changed";
  }
  EXPECT_TRUE(names_splats) << compared.out;
  for (const fs::path& folder : {out(), other}) fs::rename(folder / "volume.vdb", folder / "v");
  const auto both = run_cgs("verify " + out().string() + " " + other.string());
  for (const fs::path& folder : {out(), other}) fs::rename(folder / "v", folder / "volume.vdb");
  EXPECT_NE(both.out.find("volume.vdb: missing"), std::string::npos) << both.out;
}

}  // namespace
}  // namespace cgs::test
