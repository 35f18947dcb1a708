// SPDX-License-Identifier: GPL-3.0-or-later
// A run that is killed or interrupted at any moment loses no finished work and leaves no half file:
// the files that are there are whole, and the run that goes on ends with the bytes of one that was
// never disturbed. CGS_KILLS says how often that is tried.
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/portal_capture.h"
#include "tests/support/run_folder.h"

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
          "--set",
          "steps=10",  // no stage takes much longer than the others
          "-q",
          "-o",
          out.string()};
}

Arguments train_arguments(const fs::path& capture, const char* steps, const fs::path& out) {
  return {"train",
          capture.string(),
          "--views",
          "view_01,view_02,view_03",
          "--downscale",
          "4",
          "--set",
          steps,
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

/// How a program ended that was sent a signal, unless it had ended by itself before.
struct End {
  int code;       ///< -1 if it was killed.
  Seconds after;  ///< The signal.
};

End signal_after(Seconds wait, int signal, const Arguments& arguments) {
  const pid_t child = start_cgs(arguments);
  std::this_thread::sleep_for(wait);
  ::kill(child, signal);
  const auto sent = std::chrono::steady_clock::now();
  const int code = exit_code_of(child);
  return {code, std::chrono::steady_clock::now() - sent};
}

// Of few interrupts, or on a machine that does other things, the times say nothing.
void expect_soon(std::vector<double> seconds) {
  constexpr size_t kEnough = 50;
  if (seconds.empty()) return;
  std::sort(seconds.begin(), seconds.end());
  const double most = seconds[(seconds.size() * 95 + 99) / 100 - 1];
  std::printf("cancel: %zu interrupts, median %.2f s, 95 %% within %.2f s\n",
              seconds.size(),
              seconds[seconds.size() / 2],
              most);
  if (seconds.size() >= kEnough) EXPECT_LE(most, 1);
}

// How often a program is stopped, if the environment does not say.
int wished_kills(int otherwise) {
  const char* const wish = std::getenv("CGS_KILLS");
  return wish != nullptr ? std::atoi(wish) : otherwise;
}

TEST(Killed, TrainingLosesWhatWasDoneSinceItsLastState) {
  constexpr double kBetweenStates = 20;  // [s]
  const test::TempDir dir;
  test::copy_portal_capture(dir / "capture", 3);
  const Arguments arguments = train_arguments(dir / "capture", "steps=100000", dir / "model");
  std::mt19937 random(11);
  double worst = 0;
  for (int i = 0; i < std::max(1, wished_kills(1) / 20); ++i) {
    const Seconds wait(std::uniform_real_distribution<>(1.5, 2.5)(random) * kBetweenStates);
    EXPECT_EQ(signal_after(wait, SIGKILL, arguments).code, -1);
    const fs::path state = dir / "model/training.checkpoint";
    ASSERT_TRUE(fs::exists(state));
    const Seconds lost = fs::file_time_type::clock::now() - fs::last_write_time(state);
    worst = std::max(worst, lost.count());
  }
  std::printf("lost: at worst %.0f s of training\n", worst);
  EXPECT_LT(worst, kBetweenStates + 5);
}

// Interrupted, a training saves its state: whatever moments these are, it ends with the same model.
TEST(Killed, InterruptedTrainingEndsWithTheModelOfOneThatWasNot) {
  const test::TempDir dir;
  test::copy_portal_capture(dir / "capture", 3);
  const auto arguments = [&](const char* model) {
    return train_arguments(dir / "capture", "steps=600", dir / model);
  };
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(exit_code_of(start_cgs(arguments("whole"))), 0);
  const Seconds whole = std::chrono::steady_clock::now() - start;
  std::mt19937 random(5);
  int stopped = 0;
  bool is_finished = false;
  for (int i = 0; i < 15 && stopped < 5; ++i) {
    const double part = std::uniform_real_distribution<>(0.1, 0.6)(random);
    const End end = signal_after(whole * part, i % 2 == 0 ? SIGINT : SIGTERM, arguments("stopped"));
    is_finished = end.code == 0;
    if (is_finished) break;
    EXPECT_EQ(end.code, i % 2 == 0 ? 130 : 143);
    stopped += fs::exists(dir / "stopped/training.checkpoint") ? 1 : 0;
  }
  EXPECT_GE(stopped, 1);
  if (!is_finished) EXPECT_EQ(exit_code_of(start_cgs(arguments("stopped"))), 0);
  EXPECT_TRUE(test::read_bytes(dir / "whole/gaussians.ply") ==
              test::read_bytes(dir / "stopped/gaussians.ply"));
}

// The second ends the program at once, wherever it is.
TEST(Killed, TwoInterruptsLeaveNoHalfFile) {
  const test::TempDir dir;
  test::copy_portal_capture(dir / "capture", 3);
  const Arguments arguments = run_arguments(dir / "capture", dir / "out");
  ASSERT_EQ(exit_code_of(start_cgs(run_arguments(dir / "capture", dir / "whole"))), 0);
  const auto expected = test::files_of_run(dir / "whole");
  for (const double wait : {1.0, 2.0, 3.0}) {
    const pid_t child = start_cgs(arguments);
    std::this_thread::sleep_for(Seconds(wait));
    ::kill(child, SIGINT);
    std::this_thread::sleep_for(Seconds(0.01));
    ::kill(child, SIGINT);
    const int code = exit_code_of(child);
    EXPECT_TRUE(code == 130 || code == -1) << code;
    for (const auto& [name, bytes] : test::files_of_run(dir / "out")) {
      if (!test::is_unfinished(name)) EXPECT_TRUE(bytes == expected.at(name)) << name;
    }
  }
  EXPECT_EQ(exit_code_of(start_cgs(arguments)), 0);
  EXPECT_TRUE(test::files_of_run(dir / "out") == expected);
}

TEST(Killed, RunGoesOnToTheFilesOfOneThatWasNotKilled) {
  const test::TempDir dir;
  const fs::path capture = dir / "capture";
  test::copy_portal_capture(capture, 3);
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(exit_code_of(start_cgs(run_arguments(capture, dir / "whole"))), 0);
  const Seconds whole = std::chrono::steady_clock::now() - start;
  const auto expected = test::files_of_run(dir / "whole");
  ASSERT_TRUE(expected.contains("web/asset.glb"));

  const int wished = wished_kills(6);
  constexpr std::array<int, 8> kSignals = {
      SIGKILL, SIGINT, SIGKILL, SIGKILL, SIGKILL, SIGTERM, SIGKILL, SIGKILL};
  const Arguments arguments = run_arguments(capture, dir / "killed");
  std::mt19937 random(7);
  int runs = 0;
  int kills = 0;
  std::vector<double> latency;
  for (; kills < wished && runs < 4 * wished; ++runs) {
    // Of the whole: so the stages of a run that is stopped again and again all have their turn.
    const double part = std::uniform_real_distribution<>(0.02, 0.5)(random);
    const int signal = kSignals.at(static_cast<size_t>(runs) % kSignals.size());
    const auto [code, after] = signal_after(whole * part, signal, arguments);
    if (!fs::exists(dir / "killed")) continue;
    for (const auto& [name, bytes] : test::files_of_run(dir / "killed")) {
      if (test::is_unfinished(name)) continue;
      ASSERT_TRUE(expected.contains(name)) << name;
      EXPECT_TRUE(bytes == expected.at(name)) << name << " after run " << runs;
    }
    if (code == 0) {
      fs::remove_all(dir / "killed");  // it ended by itself; begin anew
      continue;
    }
    EXPECT_EQ(code, signal == SIGKILL ? -1 : 128 + signal);
    if (signal == SIGKILL) {
      ++kills;
    } else {
      latency.push_back(after.count());
    }
  }
  expect_soon(latency);
  std::printf("kills: %d, and %zu interrupts, of %d runs\n", kills, latency.size(), runs);
  EXPECT_EQ(kills, wished);
  EXPECT_EQ(exit_code_of(start_cgs(arguments)), 0);
  EXPECT_TRUE(test::files_of_run(dir / "killed") == expected);
}

}  // namespace
}  // namespace cgs
