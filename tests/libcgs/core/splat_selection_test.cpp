// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/splat_selection.h"

#include <gtest/gtest.h>

#include "tests/support/sample_splats.h"

namespace cgs::splat_selection_test {
namespace {

TEST(KeepOnly, KeepsAllThatBelongsToASplatTogether) {
  const Gaussians all = test::varied_splats(6, 1);
  for (const bool states_provenance : {false, true}) {
    Gaussians g = all;
    if (states_provenance) {
      for (int number = 0; number < 6; ++number) {
        g.provenance.push_back(static_cast<Provenance>(number));
      }
    }
    g.synthetic = {0, 1, 2, 3, 4, 5};
    EXPECT_EQ(keep_only(g, {0, 1, 0, 0, 1, 1}), 3u);
    EXPECT_EQ(g.synthetic, (std::vector<uint8_t>{1, 4, 5}));
    ASSERT_EQ(g.size(), 3u);
    const std::vector<size_t> kept = {1, 4, 5};
    for (size_t i = 0; i < kept.size(); ++i) {
      EXPECT_EQ(g.position[i], all.position[kept[i]]);
      EXPECT_EQ(g.scale[i], all.scale[kept[i]]);
      EXPECT_EQ(g.rotation[i], all.rotation[kept[i]]);
      EXPECT_EQ(g.opacity[i], all.opacity[kept[i]]);
      for (size_t k = 0; k < 4; ++k) EXPECT_EQ(g.sh[4 * i + k], all.sh[4 * kept[i] + k]);
    }
    EXPECT_EQ(g.sh.size(), 12u);
    const std::vector<Provenance> labels = {
        Provenance::SingleView, Provenance::Virtual, Provenance::Estimated};
    EXPECT_EQ(g.provenance, states_provenance ? labels : std::vector<Provenance>{});
  }
}

}  // namespace
}  // namespace cgs::splat_selection_test
