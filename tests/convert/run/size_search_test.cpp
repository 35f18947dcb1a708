// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/size_search.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::size_search_test {
namespace {

// A file of a fixed part and one that falls as a power of the detail.
size_t bytes_of(double detail, double power, double fixed = 20'000) {
  return static_cast<size_t>(fixed + 1e6 * std::pow(detail / 1e-3, -power));
}

TEST(FinestWithin, FindsWhereAPowerLawMeetsTheLimit) {
  for (const double power : {0.7, 1.0, 2.0, 3.0}) {
    for (const size_t limit : {900'000, 400'000, 60'000, 21'000}) {
      const auto bytes_at = [&](double detail) { return bytes_of(detail, power); };
      const SizeSearch found = finest_within(limit, 1e-3, 100, bytes_at);
      ASSERT_TRUE(found.detail) << power << " " << limit;
      EXPECT_LE(bytes_at(*found.detail), limit);
      const double exact = 1e-3 * std::pow(1e6 / (double(limit) - 20'000), 1 / power);
      // As near as the search promises: 3 % of the limit, or 2 % of the length.
      EXPECT_TRUE(double(bytes_at(*found.detail)) >= 0.97 * double(limit) ||
                  *found.detail <= exact * 1.021)
          << power << " " << limit << " " << *found.detail << " " << exact;
      EXPECT_LE(found.tried.size(), 20u);
    }
  }
}

TEST(FinestWithin, TakesTheFinestWhereThatFits) {
  const SizeSearch found =
      finest_within(2'000'000, 1e-3, 1, [](double d) { return bytes_of(d, 1); });
  EXPECT_EQ(found.detail, 1e-3);
  EXPECT_EQ(found.tried.size(), 1u);
}

TEST(FinestWithin, SaysTheSmallestWhereNothingFits) {
  const SizeSearch found = finest_within(10'000, 1e-3, 1, [](double d) { return bytes_of(d, 1); });
  EXPECT_FALSE(found.detail);
  EXPECT_EQ(found.tried.back().detail, 1);
  EXPECT_EQ(found.smallest(), bytes_of(1, 1));
}

TEST(FinestWithin, ReturnsWhatWasSeenToFitWhereSizesJump) {
  // Steps, and a form in between that is larger than finer ones.
  const auto bytes_at = [](double d) -> size_t {
    if (d > 0.02 && d < 0.03) return 900'000;
    return bytes_of(std::pow(2, std::floor(std::log2(d))), 1.5);
  };
  for (const size_t limit : {800'000, 300'000, 70'000, 25'000}) {
    const SizeSearch found = finest_within(limit, 1e-3, 1, bytes_at);
    ASSERT_TRUE(found.detail) << limit;
    EXPECT_LE(bytes_at(*found.detail), limit);
    for (const TriedSize& form : found.tried) {
      EXPECT_EQ(form.bytes, bytes_at(form.detail));
      if (form.bytes <= limit) EXPECT_GE(form.detail, *found.detail);
    }
  }
}

// The smallest of the coarsest forms need not be the last.
TEST(FinestWithin, ReachesWhatItSaysCanBeReached) {
  const auto bytes_at = [](double d) -> size_t {
    return d > 0.8 ? 36'700 : bytes_of(d, 1.1, 30'000);
  };
  const size_t least = finest_within(1'000, 1e-3, 1, bytes_at).smallest();
  for (const size_t limit : {least, least + 100, least + 1'000, least + 3'000}) {
    EXPECT_TRUE(finest_within(limit, 1e-3, 1, bytes_at).detail) << limit;
  }
}

TEST(FinestWithin, EndsWhereAllSizesAreEqual) {
  const SizeSearch none = finest_within(99, 1e-3, 1, [](double) { return size_t{100}; });
  EXPECT_FALSE(none.detail);
  EXPECT_LE(none.tried.size(), 20u);
  EXPECT_EQ(finest_within(100, 1, 1, [](double) { return size_t{100}; }).detail, 1);
  EXPECT_THROW(finest_within(1, 0, 1, [](double) { return size_t{1}; }), InvalidInput);
  EXPECT_THROW(finest_within(1, 2, 1, [](double) { return size_t{1}; }), InvalidInput);
}

}  // namespace
}  // namespace cgs::size_search_test
