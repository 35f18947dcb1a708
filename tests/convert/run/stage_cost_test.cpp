// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/stage_cost.h"

#include <ctime>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::stage_cost_test {
namespace {

TEST(CostMeter, CountsTheWorkOfAllThreadsAndNoSleep) {
  const CostMeter meter;
  const auto work = [] {
    timespec t = {};
    do {
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    } while (t.tv_sec == 0 && t.tv_nsec < 150'000'000);
  };
  std::thread one(work);
  std::thread two(work);
  one.join();
  two.join();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const StageCost cost = meter.read();
  EXPECT_NEAR(cost.cpu, 0.3, 0.05);
  EXPECT_GE(cost.wall, 0.349);
}

TEST(CostMeter, PeakForgetsWhatWasBefore) {
  constexpr size_t kLarge = 300u << 20;
  const CostMeter first;
  std::vector<char>(kLarge, 1).back() = 2;
  const size_t high = first.read().peak_memory;
  const CostMeter second;
  const size_t low = second.read().peak_memory;
  if (low == 0) GTEST_SKIP() << "this system does not let a process reset its peak";
  EXPECT_GE(high, kLarge);
  EXPECT_LT(low, kLarge / 2);
}

}  // namespace
}  // namespace cgs::stage_cost_test
