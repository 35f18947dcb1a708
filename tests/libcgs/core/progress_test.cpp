// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/progress.h"

#include <algorithm>
#include <atomic>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs::progress_test {
namespace {

TEST(SharedProgress, NeverFallsAndIsToldFromOneThreadAtATime) {
  std::atomic<int> telling = 0;
  std::vector<double> told;
  const Progress progress = [&](double fraction) {
    EXPECT_EQ(++telling, 1);
    told.push_back(fraction);
    --telling;
  };
  constexpr size_t kItems = 10000;
  SharedProgress shared(progress, kItems);
  tbb::parallel_for(size_t{0}, kItems, [&](size_t) { shared.advance(); });
  ASSERT_FALSE(told.empty());
  EXPECT_GT(told.front(), 0);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_LE(told.back(), 1);
}

TEST(SharedProgress, StopsALoopThatIsCancelled) {
  const Progress cancel = [](double fraction) {
    if (fraction > 0.01) throw Cancelled();
  };
  constexpr size_t kItems = 1000000;
  SharedProgress shared(cancel, kItems);
  std::atomic<size_t> done = 0;
  const auto loop = [&] {
    tbb::parallel_for(size_t{0}, kItems, [&](size_t) {
      ++done;
      shared.advance();
    });
  };
  EXPECT_THROW(loop(), Cancelled);
  EXPECT_LT(done, kItems);
}

TEST(SharedProgress, NeedsNobodyToTell) {
  const Progress none;
  SharedProgress shared(none, 2);
  EXPECT_NO_THROW(shared.advance());
}

}  // namespace
}  // namespace cgs::progress_test
