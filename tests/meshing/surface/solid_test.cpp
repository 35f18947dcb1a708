// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/solid.h"

#include <numeric>

#include <gtest/gtest.h>

namespace cgs::solid_test {
namespace {

// A box of 24 voxels a side without matter.
Solid nothing() {
  Solid out;
  out.size = {24, 24, 24};
  out.inside.assign(24 * 24 * 24, 0);
  out.evidence.assign(out.inside.size(), 0);
  return out;
}

// Fills a cube; all its voxels were observed, or none.
void put(Solid& solid, int begin, int end, uint8_t inside, bool is_observed) {
  for (int x = begin; x < end; ++x) {
    for (int y = begin; y < end; ++y) {
      for (int z = begin; z < end; ++z) {
        solid.inside[solid.index(x, y, z)] = inside;
        solid.evidence[solid.index(x, y, z)] = is_observed ? 1 : 0;
      }
    }
  }
}

int matter(const Solid& solid) {
  return std::accumulate(solid.inside.begin(), solid.inside.end(), 0);
}

TEST(RemoveSmallParts, FillsACavityAndRemovesAFloater) {
  Solid body = nothing();
  put(body, 2, 14, 1, true);
  put(body, 6, 8, 0, false);
  put(body, 18, 20, 1, true);
  const SolidParts found = remove_small_parts(body, 0.01);
  EXPECT_EQ(found.floaters, 1u);
  EXPECT_EQ(found.cavities, 1u);
  EXPECT_EQ(matter(body), 12 * 12 * 12);
}

TEST(RemoveSmallParts, LeavesNothingOfAHollowFloater) {
  Solid body = nothing();
  put(body, 1, 13, 1, true);
  put(body, 15, 21, 1, false);  // which nobody saw
  put(body, 17, 19, 0, false);
  const SolidParts found = remove_small_parts(body, 0.001);
  EXPECT_EQ(found.floaters, 1u);
  EXPECT_EQ(found.cavities, 0u);
  EXPECT_EQ(matter(body), 12 * 12 * 12);
}

TEST(RemoveSmallParts, FillsACavityWithWhatFloatsInIt) {
  Solid body = nothing();
  put(body, 2, 16, 1, true);
  put(body, 6, 12, 0, false);
  put(body, 8, 10, 1, true);
  (void)remove_small_parts(body, 0.05);
  EXPECT_EQ(matter(body), 14 * 14 * 14);
}

}  // namespace
}  // namespace cgs::solid_test
