// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/photograph_cache.h"

#include <gtest/gtest.h>

namespace cgs::photograph_cache_test {
namespace {

PhotographCache::Pixels picture(float grey) {
  return {ColorImage(4, 2, Eigen::Vector3f::Constant(grey)), MaskMap(4, 2, 1)};
}

// Three floats and a byte for each of eight pixels.
constexpr size_t kBytes = 8 * (3 * 4 + 1);

TEST(PhotographCache, GivesBackWhatWasKept) {
  PhotographCache cache(2 * kBytes);
  EXPECT_FALSE(cache.find("a").has_value());
  cache.keep("a", picture(0.25f));
  cache.keep("b", picture(0.5f));
  EXPECT_EQ(cache.find("a")->image.data, picture(0.25f).image.data);
  EXPECT_EQ(cache.find("b")->image.data, picture(0.5f).image.data);
  EXPECT_EQ(cache.find("b")->valid.data, picture(0.5f).valid.data);
}

TEST(PhotographCache, KeepsNoMoreThanItMay) {
  PhotographCache cache(2 * kBytes - 1);
  cache.keep("a", picture(0));
  cache.keep("b", picture(1));
  EXPECT_TRUE(cache.find("a").has_value());
  EXPECT_FALSE(cache.find("b").has_value());
  PhotographCache none(0);
  none.keep("a", picture(0));
  EXPECT_FALSE(none.find("a").has_value());
}

TEST(PhotographCache, CountsTheSameKeyOnce) {
  PhotographCache cache(2 * kBytes);
  for (int i = 0; i < 3; ++i) cache.keep("a", picture(0));
  cache.keep("b", picture(1));
  EXPECT_TRUE(cache.find("b").has_value());
}

}  // namespace
}  // namespace cgs::photograph_cache_test
