// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "meshing/volume/tsdf.h"

namespace cgs::test {

/// The same views, made when they are asked for.
inline TsdfSource source_of(const std::vector<TsdfView>& views) {
  return {views.size(), [&views](size_t i, bool with_color) {
            TsdfView view = views[i];
            if (!with_color) view.color = {};
            return view;
          }};
}

/// Of one grid: every value, active or not.
template <typename Grid>
void expect_same(const Grid& a, const Grid& b) {
  ASSERT_TRUE(a.tree().hasSameTopology(b.tree())) << a.getName();
  auto other = b.getConstAccessor();
  for (auto it = a.cbeginValueAll(); it; ++it) {
    ASSERT_EQ(*it, other.getValue(it.getCoord())) << a.getName();
  }
}

/// Volumes and reports, to the bit.
inline void expect_same(const FusedVolume& a, const FusedVolume& b) {
  expect_same(*a.volume.tsdf, *b.volume.tsdf);
  expect_same(*a.volume.weight, *b.volume.weight);
  expect_same(*a.volume.color, *b.volume.color);
  expect_same(*a.volume.support, *b.volume.support);
  expect_same(*a.volume.sigma, *b.volume.sigma);
  expect_same(*a.volume.state, *b.volume.state);
  EXPECT_EQ(a.report.free, b.report.free);
  EXPECT_EQ(a.report.occupied, b.report.occupied);
  EXPECT_EQ(a.report.estimated, b.report.estimated);
  EXPECT_EQ(a.report.hidden, b.report.hidden);
  EXPECT_EQ(a.report.unseen, b.report.unseen);
  EXPECT_EQ(a.report.conflicts, b.report.conflicts);
  EXPECT_EQ(a.report.carved, b.report.carved);
}

}  // namespace cgs::test
