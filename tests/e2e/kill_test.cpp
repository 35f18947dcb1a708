// SPDX-License-Identifier: GPL-3.0-or-later
// A run that is killed at any moment loses no finished work and leaves no half file: the files that
// are there are whole, and the run that goes on ends with the bytes of one that was never
// disturbed.
#include <chrono>
#include <csignal>
#include <map>
#include <random>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "samples/capture/files.h"
#include "tests/support/run_cgs.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;
using Arguments = std::vector<std::string>;

Arguments run_arguments(const fs::path& capture, const fs::path& out) {
  return {"run",
          capture.string(),
          "--views",
          "view_01,view_02,view_03",
          "--assume-unit",
          "m",
          "--voxel-size",
          "8cm",
          "-q",
          "-o",
          out.string()};
}

pid_t start_cgs(const Arguments& arguments) {
  std::vector<const char*> argv = {CGS_BINARY};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child != 0) return child;
  const int null = ::open("/dev/null", O_WRONLY);
  ::dup2(null, STDOUT_FILENO);
  ::dup2(null, STDERR_FILENO);
  ::execv(CGS_BINARY, const_cast<char* const*>(argv.data()));
  ::_exit(127);
}

// -1 if a signal ended it.
int exit_code_of(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Exit code of a program that may end by itself before it is killed; -1 if it was killed.
int kill_after(Seconds wait, const Arguments& arguments) {
  const pid_t child = start_cgs(arguments);
  std::this_thread::sleep_for(wait);
  ::kill(child, SIGKILL);
  return exit_code_of(child);
}

// Files of a run by their path in its folder. What states times or memory is left out.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), folder).string();
    const bool states_times = name == "run.json" || name == "report.json" || name == "report.html";
    out[name] = states_times ? "" : test::read_bytes(entry.path());
  }
  return out;
}

bool is_unfinished(const std::string& name) {
  return name.find(".part") != std::string::npos || name.find(".checkpoint") != std::string::npos;
}

TEST(Killed, RunGoesOnToTheFilesOfOneThatWasNotKilled) {
  const test::TempDir dir;
  const fs::path capture = dir / "capture";
  const auto views = capture_views(3);
  write_capture(capture, portal_scene(), views, input_cameras(views));
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(exit_code_of(start_cgs(run_arguments(capture, dir / "whole"))), 0);
  const Seconds whole = std::chrono::steady_clock::now() - start;
  const auto expected = files_of(dir / "whole");
  ASSERT_TRUE(expected.contains("web/asset.glb"));

  const int kills = std::getenv("CGS_SWEEP") != nullptr ? 60 : 8;
  const Arguments arguments = run_arguments(capture, dir / "killed");
  std::mt19937 random(7);
  int killed = 0;
  for (int i = 0; i < kills; ++i) {
    const double part = std::uniform_real_distribution<>(0, 1)(random);
    const int code = kill_after(whole * part, arguments);
    if (!fs::exists(dir / "killed")) continue;
    for (const auto& [name, bytes] : files_of(dir / "killed")) {
      if (is_unfinished(name)) continue;
      ASSERT_TRUE(expected.contains(name)) << name;
      EXPECT_TRUE(bytes == expected.at(name)) << name << " after kill " << i;
    }
    if (code >= 0) {
      EXPECT_EQ(code, 0);
      fs::remove_all(dir / "killed");  // it ended by itself; begin anew
    } else {
      ++killed;
    }
  }
  EXPECT_GE(killed, kills / 4);
  EXPECT_EQ(exit_code_of(start_cgs(arguments)), 0);
  EXPECT_TRUE(files_of(dir / "killed") == expected);
  RecordProperty("killed", killed);
}

}  // namespace
}  // namespace cgs
