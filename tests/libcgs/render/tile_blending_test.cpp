// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/tile_blending.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::tile_blending_test {
namespace {

Splat splat_at(double u, double v, float sigma, float opacity) {
  Splat s;
  s.u = u;
  s.v = v;
  s.inv_sigma_y = 1 / sigma;
  s.sigma_x = sigma;
  s.opacity = opacity;
  s.q_max = 2 * std::log(opacity * 255);
  s.half_width = sigma * std::sqrt(s.q_max);
  s.depth = 1;
  s.color = {0.25f, 0.5f, 1};
  return s;
}

TileAccumulator blend(const std::vector<Splat>& splats,
                      int column,
                      int row,
                      std::array<int, 2> size) {
  std::vector<BandSplat> band;
  for (uint32_t i = 0; i < splats.size(); ++i)
    band.push_back(in_band(splats[i], {0, 1000}, i, row));
  std::vector<uint32_t> order(splats.size());
  std::iota(order.begin(), order.end(), 0);
  TileAccumulator tile;
  blend_tile(band, order, column, size, tile);
  return tile;
}

constexpr std::array<int, 2> kWhole = {kTileSize, kTileSize};

TEST(BlendTile, CoversTheAreaOfItsGaussian) {
  // The sum of alpha over the pixels approaches the integral 2 pi o sigma^2, less the rim below
  // 1/255 that is cut: exactly 2 pi sigma^2 (o - 1/255).
  for (const float sigma : {0.8f, 1.2f, 1.9f}) {
    const TileAccumulator tile = blend({splat_at(39.3, 24.6, sigma, 0.5f)}, 32, 16, kWhole);
    double sum = 0;
    for (const float T : tile.transmittance) sum += 1 - double(T);
    const double s2 = double(sigma) * double(sigma);
    EXPECT_NEAR(sum, 2 * M_PI * s2 * (0.5 - 1 / 255.0), 0.015 * s2) << sigma;
  }
}

TEST(BlendTile, FollowsTheExponentialInEveryPixel) {
  for (const double u : {-3.0, 0.5, 7.7, 8.2, 15.9, 19.0}) {
    for (const float sigma : {0.6f, 3.0f, 40.0f}) {
      const TileAccumulator tile = blend({splat_at(u, 6.1, sigma, 0.8f)}, 0, 0, kWhole);
      for (int y = 0; y < kTileSize; ++y) {
        for (int x = 0; x < kTileSize; ++x) {
          const double r2 = std::pow(x + 0.5 - u, 2) + std::pow(y + 0.5 - 6.1, 2);
          const double alpha = double(0.8f) * std::exp(-0.5 * r2 / std::pow(double(sigma), 2));
          const double T = double(tile.transmittance[y * kTileSize + x]);
          if (std::abs(alpha * 255 - 1) < 1e-4) continue;  // on the cut, rounding decides
          EXPECT_NEAR(1 - T, alpha < 1.0 / 255 ? 0 : alpha, 1e-6) << u << ' ' << x << ' ' << y;
        }
      }
    }
  }
}

TEST(BlendTile, RemembersWhatMadeAPixelOpaque) {
  std::vector<Splat> splats(3, splat_at(8, 8, 50, 0.3f));
  for (size_t i = 0; i < splats.size(); ++i) splats[i].depth = 1 + float(i);
  const TileAccumulator tile = blend(splats, 0, 0, kWhole);
  const size_t centre = 8 * kTileSize + 8;
  EXPECT_EQ(tile.last_above_half[centre], 2);  // 0.7, then 0.49
  EXPECT_EQ(tile.strongest[centre], 0);
  EXPECT_EQ(tile.first_depth[centre], 1);
}

TEST(BlendTile, LeavesPixelsBeyondTheImageAlone) {
  const TileAccumulator tile = blend({splat_at(8, 8, 50, 0.9f)}, 0, 0, {5, 3});
  for (int y = 0; y < kTileSize; ++y) {
    for (int x = 0; x < kTileSize; ++x) {
      EXPECT_EQ(tile.strongest[y * kTileSize + x], x < 5 && y < 3 ? 0 : -1);
    }
  }
}

TEST(BlendTile, StopsBlendingAFinishedPixel) {
  std::vector<Splat> splats(200, splat_at(8, 8, 1000, 1));
  const TileAccumulator tile = blend(splats, 0, 0, kWhole);
  for (const float T : tile.transmittance) {
    EXPECT_LT(T, kMinTransmittance);
    EXPECT_GT(T, 0.009f * kMinTransmittance);  // one splat takes no more than 99 %
  }
}

}  // namespace
}  // namespace cgs::tile_blending_test
