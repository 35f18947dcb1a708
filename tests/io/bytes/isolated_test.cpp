// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/isolated.h"

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "io/bytes/sanitized.h"
#include "libcgs/core/error.h"

namespace cgs::isolated_test {
namespace {

TEST(RunIsolated, HandsOverWhatTheChildReturns) {
  const std::string large(3'000'000, 'x');  // more than a pipe holds
  EXPECT_EQ(run_isolated([&] { return large + "y"; }, "a"), large + "y");
  EXPECT_EQ(run_isolated([] { return std::string(); }, "a"), "");
}

TEST(RunIsolated, TurnsACrashIntoAMessage) {
  EXPECT_THROW(run_isolated([]() -> std::string { std::abort(); }, "a"), BadInput);
  try {
    run_isolated([]() -> std::string { throw std::runtime_error("no such thing"); }, "a.glb");
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("a.glb"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("no such thing"), std::string::npos) << error.what();
  }
}

TEST(RunIsolated, LeavesInterruptsToTheParent) {
  const auto interrupted = [] {
    std::raise(SIGINT);
    std::raise(SIGTERM);
    return std::string("whole");
  };
  EXPECT_EQ(run_isolated(interrupted, "a"), "whole");
}

TEST(RunIsolated, LimitsMemory) {
  if (kIsSanitized) GTEST_SKIP() << "AddressSanitizer needs the addresses for itself";
  const auto greedy = [] { return std::to_string(std::vector<char>(size_t{1} << 30, 'x').size()); };
  EXPECT_THROW(run_isolated(greedy, "a", {.memory = size_t{64} << 20}), LimitError);
  EXPECT_EQ(run_isolated(greedy, "a"), std::to_string(1 << 30));
}

TEST(RunIsolated, LimitsTime) {
  volatile bool forever = true;
  const auto endless = [&]() -> std::string {
    while (forever) {
    }
    return "";
  };
  EXPECT_THROW(run_isolated(endless, "a", {.seconds = 1}), LimitError);
}

}  // namespace
}  // namespace cgs::isolated_test
