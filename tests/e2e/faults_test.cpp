// SPDX-License-Identifier: GPL-3.0-or-later
// Every call by which a run asks the system for something in its folders fails once, and at every
// one the process is killed once. The run must end with the right exit code and one line, what it
// leaves must be whole, and the run that goes on must end with the files of one that was never
// disturbed; so must one that lacks memory, all of it or for one allocation. CGS_FAULTS says how
// many of some thousand errors, of the kills, of the limits of memory and of the allocations are
// tried.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "tests/support/portal_capture.h"
#include "tests/support/run_folder.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;

/// One call of the program's first thread and what befalls it.
struct Fault {
  std::string call;             ///< Of the system, as strace names it.
  int nth = 0;                  ///< Counted per call, from 1.
  std::string effect;           ///< As strace injects it: "error=EIO", "signal=KILL".
  bool concerns_state = false;  ///< The state of the training.

  std::string options() const {
    const std::string when = ":when=" + std::to_string(nth);
    return "-e trace=" + call + " -e inject=" + call + ":" + effect + when;
  }
};

// With --seccomp-bpf it would be quicker, but strace 6.1 then injects nothing.
const std::string kStrace = "strace -f ";
const std::string kPreload = std::string("LD_PRELOAD=") + CGS_FAILING_ALLOCATION + " ";

constexpr const char* kCalls = "openat,read,write,writev,pwrite64,lseek,fsync,rename,mkdir,unlink";

const std::map<std::string, std::vector<std::string>>& errors_of_calls() {
  static const std::map<std::string, std::vector<std::string>> all = {
      {"openat", {"EMFILE", "ENOSPC"}},
      {"read", {"EIO"}},
      {"write", {"ENOSPC", "EIO"}},
      {"writev", {"ENOSPC"}},
      {"pwrite64", {"ENOSPC"}},
      {"fsync", {"EIO"}},
      {"rename", {"EIO"}},
      {"mkdir", {"ENOSPC"}},
      {"unlink", {"EIO"}}};
  return all;
}

/// Counts a fault while it lives, and whether it brought failures.
class Counted {
 public:
  Counted() { ++tried; }
  ~Counted() {
    survived += failures() == before_ ? 1 : 0;
    if (tried % 50 == 0) std::fprintf(stderr, "so far %d survived of %d tried\n", survived, tried);
  }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

  static inline int tried = 0;
  static inline int survived = 0;

 private:
  static int failures() {
    return testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
  }
  int before_ = failures();
};

class Faults : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (std::system((kStrace + "-o /dev/null true 2>/dev/null").c_str()) != 0) {
      reason_ = "no strace here, or it may not trace";
      return;
    }
    dir_ = new test::TempDir;
    constexpr size_t kViews = 4;  // more that are held out only repeat its calls
    test::copy_portal_capture(*dir_ / "capture", 3, kViews);
    const std::string trace =
        "-y -e trace=" + std::string(kCalls) + " -o " + (*dir_ / "calls").string();
    ASSERT_EQ(run("whole", trace), 0) << message();
    expected_ = test::files_of_run(*dir_ / "whole");
    ASSERT_TRUE(expected_.contains("web/asset.glb"));
    find_places();
  }
  static void TearDownTestSuite() {
    std::printf("faults: %d survived of %d tried\n", Counted::survived, Counted::tried);
    delete dir_;
    dir_ = nullptr;
  }
  void SetUp() override {
    if (!reason_.empty()) GTEST_SKIP() << reason_;
  }

  // Exit code of a run under strace; -1 if a signal ended it.
  static int run(const std::string& out, const std::string& strace_options) {
    return run_after(strace_options.empty() ? "" : kStrace + "-qq " + strace_options + " ", out);
  }
  // The same with so much address space.
  static int run_within(size_t kibibytes, const std::string& out) {
    return run_after("ulimit -v " + std::to_string(kibibytes) + "; ", out);
  }
  static int run_after(const std::string& before, const std::string& out) {
    const std::string arguments = (*dir_ / "capture").string() +
                                  " --views view_01,view_02,view_03 --assume-unit m --voxel-size "
                                  "40cm --simplify 0 --downscale 8 "
                                  "--set steps=3 --threads 1 -q -o " +
                                  (*dir_ / out).string();
    return exit_code(before + CGS_BINARY + " run " + arguments);
  }
  // Before a command: counts its allocations, or fails one of them.
  static std::string counting_allocations() {
    return kPreload + "COUNT_ALLOCATIONS=" + (*dir_ / "allocations").string() + " ";
  }
  static size_t counted_allocations() {
    return std::stoul(test::read_bytes(*dir_ / "allocations"));
  }
  static std::string failing_allocation(size_t nth) {
    return kPreload + "FAILING_ALLOCATION=" + std::to_string(nth) + " ";
  }
  // What the command says on standard error is message().
  static int exit_code(const std::string& command) {
    const std::string quiet = command + " >/dev/null 2>" + (*dir_ / "message").string();
    const int status = std::system(quiet.c_str());
    // strace ends by the signal that ended its child, the shell with 128 + its number.
    return WIFEXITED(status) && WEXITSTATUS(status) < 128 ? WEXITSTATUS(status) : -1;
  }
  static std::string message() { return test::read_bytes(*dir_ / "message"); }
  // Its lines but for warnings: a checkpoint that cannot be written ends no run.
  static int complaints() {
    std::istringstream lines(message());
    int out = 0;
    for (std::string line; std::getline(lines, line);) {
      out += line.rfind("cgs: warning: ", 0) == 0 ? 0 : 1;
    }
    return out;
  }

  // The calls of the first thread that concern the folder of this test, from strace's log.
  static void find_places() {
    std::ifstream log(*dir_ / "calls");
    const std::regex form(R"(^(\d+)\s+(\w+)\((.*)$)");
    const std::string folder = dir_->path().string();
    std::string first_thread;
    std::map<std::string, int> count;
    for (std::string line; std::getline(log, line);) {
      std::smatch parts;
      if (!std::regex_match(line, parts, form)) continue;
      if (first_thread.empty()) first_thread = parts[1];
      if (parts[1] != first_thread) continue;
      const int nth = ++count[parts[2]];
      if (parts[3].str().find(folder) == std::string::npos) continue;
      const bool concerns_state = parts[3].str().find("training.checkpoint") != std::string::npos;
      places_.push_back({parts[2], nth, "", concerns_state});
    }
  }

  // How many faults of a kind are tried, of `most`; `few` if nothing is said.
  static size_t share_of(size_t most, size_t few) {
    const char* const wish = std::getenv("CGS_FAULTS");
    return std::min(most, wish != nullptr ? std::stoul(wish) : few);
  }

  // Where an effect is tried: at all places, or at some of them.
  static std::vector<Fault> sample(std::vector<Fault> all, size_t few) {
    const size_t share = share_of(all.size(), few);
    std::vector<Fault> out;
    for (size_t i = 0; i < share; ++i) out.push_back(all[i * all.size() / share]);
    return out;
  }

  // What lies in the folder after a fault: whole files of a whole run, and the state of unfinished
  // work.
  static void expect_whole_files(const std::string& out, bool may_leave_parts) {
    for (const auto& [name, bytes] : test::files_of_run(*dir_ / out)) {
      if (test::is_unfinished(name)) {
        EXPECT_TRUE(may_leave_parts || name.ends_with(".checkpoint")) << name << " was left behind";
        continue;
      }
      ASSERT_TRUE(expected_.contains(name)) << name;
      EXPECT_TRUE(bytes == expected_.at(name)) << name << " differs";
    }
  }
  static void expect_going_on() {
    EXPECT_EQ(run("out", ""), 0) << message();
    EXPECT_TRUE(test::files_of_run(*dir_ / "out") == expected_);
    fs::remove_all(*dir_ / "out");
  }

  static void expect_want_of_memory_is_said() {
    const std::string text = message();
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
    EXPECT_NE(text.find("LIMIT"), std::string::npos) << text;
    if (fs::exists(*dir_ / "out")) expect_whole_files("out", false);
    expect_going_on();
  }

  static inline test::TempDir* dir_ = nullptr;
  static inline std::string reason_;
  static inline std::map<std::string, std::string> expected_;
  static inline std::vector<Fault> places_;
};

// A file that is there is as it stays: what is put in its place later would leave the first where a
// fault comes between them.
TEST_F(Faults, NoFileIsWrittenTwice) {
  std::ifstream log(*dir_ / "calls");
  const std::regex form(R"re(rename\(.*"([^"]*)"\))re");
  std::map<std::string, int> written;
  for (std::string line; std::getline(log, line);) {
    std::smatch parts;
    if (std::regex_search(line, parts, form)) ++written[parts[1]];
  }
  ASSERT_GT(written.size(), 30u);
  for (const auto& [name, times] : written) {
    const bool is_of_the_run = name.ends_with("run.json") || test::is_unfinished(name);
    EXPECT_TRUE(times == 1 || is_of_the_run) << name << ": " << times << " times";
  }
}

TEST_F(Faults, AnErrorOfTheSystemIsReportedAndNothingIsLost) {
  std::vector<Fault> faults;
  for (const Fault& place : places_) {
    const auto errors = errors_of_calls().find(place.call);
    if (errors == errors_of_calls().end()) continue;
    for (const std::string& error : errors->second) {
      faults.push_back({place.call, place.nth, "error=" + error});
    }
  }
  ASSERT_GT(faults.size(), 100u);
  int reported = 0;
  const std::vector<Fault> tried = sample(faults, 14);
  for (const Fault& fault : tried) {
    SCOPED_TRACE(fault.options());
    const Counted counted;
    const int code = run("out", fault.options() + " -o /dev/null");
    EXPECT_TRUE(code == 0 || code == 3 || code == 5) << code << ": " << message();
    EXPECT_EQ(complaints(), code == 0 ? 0 : 1) << message();
    reported += code == 0 ? 0 : 1;
    // What a disk does not remove stays until the next run.
    const bool removes = fault.call == "unlink";
    if (code == 0 && !removes) {
      EXPECT_TRUE(test::files_of_run(*dir_ / "out") == expected_);
    }
    expect_whole_files("out", removes);
    expect_going_on();
  }
  // The others concern what may fail, such as a file that is only looked for.
  EXPECT_GE(4 * reported, static_cast<int>(tried.size()));
}

TEST_F(Faults, AStateThatCannotBeSavedIsSaidAndChangesNoFile) {
  std::vector<std::string> tried;
  for (const Fault& place : places_) {
    const bool writes = place.call == "openat" || place.call == "write" || place.call == "fsync";
    const bool is_first = std::find(tried.begin(), tried.end(), place.call) == tried.end();
    if (!place.concerns_state || !writes || !is_first) continue;
    tried.push_back(place.call);
    const Fault fault = {place.call, place.nth, "error=ENOSPC"};
    SCOPED_TRACE(fault.options());
    const Counted counted;
    EXPECT_EQ(run("out", fault.options() + " -o /dev/null"), 0) << message();
    EXPECT_NE(message().find("going on without it"), std::string::npos) << message();
    EXPECT_TRUE(test::files_of_run(*dir_ / "out") == expected_);
    fs::remove_all(*dir_ / "out");
  }
  EXPECT_EQ(tried.size(), 3u);
}

TEST_F(Faults, AKillAnywhereLosesNothing) {
  std::vector<Fault> faults;
  for (const Fault& place : places_) {
    if (place.call == "read" || place.call == "lseek") continue;  // change nothing on the disk
    faults.push_back({place.call, place.nth, "signal=KILL"});
  }
  ASSERT_GT(faults.size(), 100u);
  for (const Fault& fault : sample(faults, 8)) {
    SCOPED_TRACE(fault.options());
    const Counted counted;
    EXPECT_EQ(run("out", fault.options() + " -o /dev/null"), -1) << message();
    expect_whole_files("out", true);
    expect_going_on();
  }
}

// Halves the distance between a limit that is too small and one that is not until it is `step`.
template <typename IsEnough>
std::pair<size_t, size_t> bisect(size_t low, size_t high, size_t step, IsEnough is_enough) {
  while (high - low > step) {
    const size_t middle = (low + high) / 2;
    (is_enough(middle) ? high : low) = middle;
  }
  return {low, high};
}

TEST_F(Faults, MemoryThatRunsOutAnywhereIsSaidAndNothingIsLost) {
  constexpr size_t kMost = size_t{4} << 20;  // [KiB]
  const auto starts = [](size_t limit) {
    return exit_code("ulimit -v " + std::to_string(limit) + "; " + CGS_BINARY + " --version") == 0;
  };
  const auto ends = [](size_t limit) {
    const bool is_enough = run_within(limit, "out") == 0;
    fs::remove_all(*dir_ / "out");
    return is_enough;
  };
  const size_t least = bisect(0, kMost, 256, starts).second;  // below, its libraries do not load
  const size_t need = bisect(least, kMost, 4096, ends).first;
  ASSERT_GT(need, least + 8192);
  const size_t tried = share_of(120, 12);
  for (size_t i = 0; i < tried; ++i) {
    const size_t limit = least + 1024 + i * (need - least - 1024) / tried;
    SCOPED_TRACE(std::to_string(limit) + " of " + std::to_string(need) + " KiB");
    const Counted counted;
    EXPECT_EQ(run_within(limit, "out"), 4);
    expect_want_of_memory_is_said();
  }
}

TEST_F(Faults, AnyAllocationMayFail) {
  ASSERT_EQ(run_after(counting_allocations(), "out"), 0) << message();
  fs::remove_all(*dir_ / "out");
  const size_t count = counted_allocations();
  ASSERT_GT(count, 100'000u);
  const size_t tried = share_of(200, 6);
  size_t said = 0;
  for (size_t i = 0; i < tried; ++i) {
    const size_t nth = 1 + i * count / tried;
    SCOPED_TRACE("allocation " + std::to_string(nth) + " of " + std::to_string(count));
    const Counted counted;
    const int code = run_after(failing_allocation(nth), "out");
    EXPECT_TRUE(code == 0 || code == 4) << code << ": " << message();
    if (code == 0) {  // a library did without
      EXPECT_TRUE(test::files_of_run(*dir_ / "out") == expected_);
      fs::remove_all(*dir_ / "out");
      continue;
    }
    ++said;
    expect_want_of_memory_is_said();
  }
  EXPECT_GE(2 * said, tried);
}

// Libraries that decode images have standard error taken from them, and some abort.
TEST_F(Faults, AnyAllocationOfReadingPhotographsMayFail) {
  // A sweep of two, which comes after, is soon done.
  const std::string info = std::string(CGS_BINARY) + " info " + (*dir_ / "capture").string() +
                           " --views view_01,view_02 --json";
  ASSERT_EQ(exit_code(counting_allocations() + info), 0) << message();
  // The first photograph has them announce all their formats; the others only repeat its calls.
  const size_t count = counted_allocations() / 4;
  const size_t tried = share_of(600, 60);
  ASSERT_GT(count, tried);
  size_t said = 0;
  for (size_t i = 0; i < tried; ++i) {
    const size_t nth = 1 + i * count / tried;
    SCOPED_TRACE("allocation " + std::to_string(nth) + " of " + std::to_string(count));
    const Counted counted;
    const int code = exit_code(failing_allocation(nth) + info);
    EXPECT_TRUE(code == 0 || code == 4) << code << ": " << message();
    EXPECT_EQ(complaints(), code == 0 ? 0 : 1) << message();
    EXPECT_EQ(message().find("LIMIT") != std::string::npos, code == 4) << message();
    said += code == 4 ? 1 : 0;
  }
  EXPECT_GE(2 * said, tried);
}

// Its library says no more than that it failed.
TEST_F(Faults, AnyAllocationOfWriting3mfMayFail) {
  const fs::path written = *dir_ / "written.3mf";
  const std::string solid = (*dir_ / "solid.stl").string();
  std::ofstream(solid) << "solid t\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\n"
                          "vertex 1 0 0\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                          "vertex 0 0 1\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\n"
                          "vertex 0 1 0\nendloop\nendfacet\n"
                          "facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 0 1 0\n"
                          "vertex 0 0 1\nendloop\nendfacet\nendsolid t\n";
  const std::string convert =
      std::string(CGS_BINARY) + " convert --assume-unit m " + solid + " " + written.string();
  ASSERT_EQ(exit_code(counting_allocations() + convert), 0) << message();
  const size_t count = counted_allocations();
  constexpr size_t kTried = 30;
  ASSERT_GT(count, 10 * kTried);
  size_t said = 0;
  for (size_t i = 1; i <= kTried; ++i) {
    const size_t nth = count - 10 * i;
    fs::remove(written);
    SCOPED_TRACE("allocation " + std::to_string(nth) + " of " + std::to_string(count));
    const int code = exit_code(failing_allocation(nth) + convert);
    EXPECT_TRUE(code == 0 || code == 4) << code << ": " << message();
    EXPECT_EQ(fs::exists(written), code == 0);
    said += code == 4 ? 1 : 0;
  }
  EXPECT_GE(2 * said, kTried);
}

}  // namespace
}  // namespace cgs
