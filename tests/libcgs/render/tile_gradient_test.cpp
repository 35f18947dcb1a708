// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/tile_gradient.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::tile_gradient_test {
namespace {

constexpr int kFirstColumn = 48;
constexpr int kFirstRow = 32;
constexpr std::array<int, 2> kWhole = {kTileSize, kTileSize};

struct Tile {
  std::vector<BandSplat> band;
  std::vector<TileEntry> nearest_first;
  std::array<int, 2> size = kWhole;

  void add(Splat s) {
    s.q_max = 2 * std::log(s.opacity / kMinSplatAlpha) * (1 + 1e-4f) + 1e-5f;  // as projected
    const auto index = static_cast<uint32_t>(band.size());
    band.push_back(in_band(s, {0, 1000}, index, kFirstRow));
    nearest_first.push_back({.splat = index});
  }
};

// Splats in and around a tile, in no order of their indices; some are as opaque as any may be.
Tile random_tile(int count, std::array<int, 2> size, unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Tile out{.band = {}, .nearest_first = {}, .size = size};
  for (int i = 0; i < count; ++i) {
    Splat s;
    s.u = kFirstColumn + between(-4, size[0] + 4);
    s.v = kFirstRow + between(-4, size[1] + 4);
    s.slope = between(-1, 1);
    s.inv_sigma_y = float(1 / between(0.5, 12));
    s.sigma_x = float(between(0.5, 12));
    s.opacity = float(i % 10 == 0 ? 1 : between(0.01, 0.6));
    s.depth = float(between(0.4, 1.2));
    s.color = {float(between(0, 1)), float(between(0, 1)), float(between(0, 1))};
    out.add(s);
  }
  std::shuffle(out.nearest_first.begin(), out.nearest_first.end(), random);
  return out;
}

std::array<TilePlane*, 7> planes(TileLoss& loss) {
  return {&loss.color[0],
          &loss.color[1],
          &loss.color[2],
          &loss.transmittance,
          &loss.depth_sum,
          &loss.depth_square_sum,
          &loss.weight_square_sum};
}

// Random within the image, and only in the planes that the channels name.
TileLoss random_loss(LossChannels channels, std::array<int, 2> size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  TileLoss out;
  const bool squares = channels.weight_squares;
  const std::array<bool, 3> drawn = {channels.color || squares, channels.depth || squares, squares};
  const std::array<bool, 7> filled = {
      drawn[0], drawn[0], drawn[0], true, drawn[1], drawn[1], drawn[2]};
  for (size_t k = 0; k < filled.size(); ++k) {
    TilePlane& plane = *planes(out).at(k);
    plane.fill(0);
    for (int y = 0; filled.at(k) && y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) plane[tile_index(x, y)] = normal(random);
    }
  }
  return out;
}

struct Result {
  TileEnd end;
  TileSums sums;
  std::vector<SplatMoments> moments;   // by position in the band
  std::vector<ColorDerivative> color;  // the same
};

Result differentiated(Tile tile, const TileLoss& loss, LossChannels channels, bool sixteen_lanes) {
  constexpr uint32_t kOffset = 7;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const TileSplats splats{.band = tile.band,
                          .nearest_first = tile.nearest_first,
                          .first_column = kFirstColumn,
                          .sixteen_lanes = sixteen_lanes};
  Result out;
  out.sums.has_depths = channels.depth || channels.weight_squares;
  out.sums.has_weight_squares = channels.weight_squares;
  draw_tile(splats, tile.size, out.end, out.sums);
  // All of them are overwritten.
  out.moments.resize(tile.band.size());
  for (SplatMoments& record : out.moments) record.sum.fill(kNan);
  out.color.resize(channels.color_derivative ? tile.band.size() : 0, {kNan, kNan, kNan, kNan});
  std::vector<uint32_t> place(tile.band.size());
  std::iota(place.begin(), place.end(), 0u - kOffset);  // modulo 2^32
  differentiate_tile(splats, out.end, loss, channels, {place, kOffset, out.moments, out.color});
  return out;
}

// What one splat does to one pixel.
struct Touch {
  size_t splat;  // position in the band
  double t, ty, alpha, T;
  bool clamped;
};

// The splats that are blended in a pixel, nearest first, and what they let through together.
std::vector<Touch> blended(const Tile& tile, int x, int y, double& T) {
  std::vector<Touch> out;
  T = 1;
  for (const TileEntry& entry : tile.nearest_first) {
    if (T < double(kMinTransmittance)) break;
    const BandSplat& s = tile.band[entry.splat];
    const double ridge = s.x - kFirstColumn + double(s.slope) * y;
    const double t = (x + 0.5 - ridge) * double(s.inv_sigma_x);
    const double ty = (double(s.dy) + y) * double(s.inv_sigma_y);
    const double free = double(s.opacity) * std::exp(-0.5 * (t * t + ty * ty));
    if (free < double(kMinSplatAlpha)) continue;
    const double alpha = std::min(free, double(kMaxSplatAlpha));
    out.push_back({entry.splat, t, ty, alpha, T, free > alpha});
    T *= 1 - alpha;
  }
  return out;
}

// A sum and that of the magnitudes of what was added.
struct Sum {
  double value = 0;
  double magnitude = 0;

  void add(double term) {
    value += term;
    magnitude += std::abs(term);
  }
};

struct Truth {
  std::array<Sum, 7> moments;
  std::array<Sum, 3> color;
};

// One pixel from back to front: with V the value of what lies behind a splat, as if it were seen
// freely, and s' = dL/dw, dL/dalpha is T (s' - V), and V becomes alpha s' + (1 - alpha) V.
void add_pixel(const Tile& tile, const TileLoss& loss, int x, int y, std::vector<Truth>& truth) {
  const size_t p = tile_index(x, y);
  double T = 1;
  const std::vector<Touch> touches = blended(tile, x, y, T);
  double behind = loss.transmittance[p];
  for (auto it = touches.rbegin(); it != touches.rend(); ++it) {
    const BandSplat& s = tile.band[it->splat];
    const double w = it->alpha * it->T;
    const double z = s.depth;
    double of_weight = double(loss.depth_sum[p]) * z + double(loss.depth_square_sum[p]) * z * z +
                       2 * w * double(loss.weight_square_sum[p]);
    for (size_t c = 0; c < 3; ++c) of_weight += double(loss.color[c][p]) * double(s.color[c]);
    Truth& out = truth[it->splat];
    const double m = it->clamped ? 0 : it->alpha * it->T * (of_weight - behind);
    behind = it->alpha * of_weight + (1 - it->alpha) * behind;
    const std::array<double, 7> terms = {
        m,
        m * it->t,
        m * it->ty,
        m * it->t * it->t,
        m * it->t * it->ty,
        m * it->ty * it->ty,
        w * (double(loss.depth_sum[p]) + 2 * z * double(loss.depth_square_sum[p]))};
    for (size_t k = 0; k < terms.size(); ++k) out.moments[k].add(terms[k]);
    for (size_t c = 0; c < 3; ++c) out.color[c].add(w * double(loss.color[c][p]));
  }
}

// Returns how many numbers that are not zero were compared.
size_t expect_near_reference(const Tile& tile, bool sixteen_lanes) {
  const LossChannels every{
      .color = true, .depth = true, .color_derivative = true, .weight_squares = true};
  const TileLoss loss = random_loss(every, tile.size, 5);
  std::vector<Truth> truth(tile.band.size());
  for (int y = 0; y < tile.size[1]; ++y) {
    for (int x = 0; x < tile.size[0]; ++x) add_pixel(tile, loss, x, y, truth);
  }
  const Result got = differentiated(tile, loss, every, sixteen_lanes);
  size_t compared = 0;
  const auto expect = [&](float value, const Sum& sum, double of_all, size_t splat, size_t k) {
    const double room = 1e-4 * sum.magnitude + 1e-6 * of_all;
    EXPECT_NEAR(double(value), sum.value, room) << "splat " << splat << ", number " << k;
    compared += sum.magnitude > 0 ? 1 : 0;
  };
  for (size_t i = 0; i < truth.size(); ++i) {
    const double of_all = truth[i].moments[0].magnitude;
    for (size_t k = 0; k < 7; ++k) {
      expect(got.moments[i].sum.at(k), truth[i].moments.at(k), of_all, i, k);
    }
    EXPECT_EQ(got.moments[i].sum[7], 0);
    for (size_t c = 0; c < 3; ++c) expect(got.color[i][c], truth[i].color.at(c), of_all, i, 7 + c);
  }
  return compared;
}

TEST(DifferentiateTile, GivesWhatTheRecursionGivesPixelByPixel) {
  for (const bool sixteen_lanes : {false, true}) {
    if (sixteen_lanes && !has_sixteen_lanes()) continue;
    EXPECT_GT(expect_near_reference(random_tile(40, {5, 3}, 1), sixteen_lanes), 100u);
    EXPECT_GT(expect_near_reference(random_tile(40, kWhole, 2), sixteen_lanes), 200u);
  }
}

// A veil over the whole tile: alpha is 1/2 in each of 256 pixels, so that dL/dalpha is 1 - 1/4.
TEST(DifferentiateTile, KnowsTheDerivativeOfAVeil) {
  Splat veil;
  veil.u = kFirstColumn + 8;
  veil.v = kFirstRow + 8;
  veil.inv_sigma_y = 1e-4f;
  veil.sigma_x = 1e4f;
  veil.opacity = 0.5f;
  veil.depth = 1;
  veil.color = {1, 0, 0};
  Tile tile;
  tile.add(veil);
  TileLoss loss = random_loss({}, {0, 0}, 1);  // zero
  loss.color[0].fill(1);
  loss.transmittance.fill(0.25f);
  for (const bool sixteen_lanes : {false, true}) {
    if (sixteen_lanes && !has_sixteen_lanes()) continue;
    const Result got =
        differentiated(tile, loss, {.color = true, .color_derivative = true}, sixteen_lanes);
    EXPECT_NEAR(got.moments[0].sum[0], 256 * 0.5 * 0.75, 1e-3);
    EXPECT_NEAR(got.color[0][0], 256 * 0.5, 1e-3);
    EXPECT_EQ(got.color[0][1], 0);
    EXPECT_NEAR(got.end.transmittance[0], 0.5, 1e-5);
  }
}

template <typename T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

void expect_same_bits(const Tile& tile, LossChannels channels) {
  const TileLoss loss = random_loss(channels, tile.size, 6);
  const Result eight = differentiated(tile, loss, channels, false);
  const Result sixteen = differentiated(tile, loss, channels, true);
  EXPECT_EQ(eight.end.visited, sixteen.end.visited);
  EXPECT_EQ(eight.end.last, sixteen.end.last);
  EXPECT_TRUE(same_bits(eight.end.transmittance, sixteen.end.transmittance));
  EXPECT_TRUE(same_bits(eight.sums.color, sixteen.sums.color));
  if (eight.sums.has_depths) {
    EXPECT_TRUE(same_bits(eight.sums.depth, sixteen.sums.depth));
    EXPECT_TRUE(same_bits(eight.sums.depth_square, sixteen.sums.depth_square));
  }
  if (eight.sums.has_weight_squares) {
    EXPECT_TRUE(same_bits(eight.sums.weight_square, sixteen.sums.weight_square));
  }
  ASSERT_EQ(eight.color.size(), sixteen.color.size());
  for (size_t i = 0; i < eight.moments.size(); ++i) {
    EXPECT_TRUE(same_bits(eight.moments[i], sixteen.moments[i])) << i;
    if (channels.color_derivative) {
      EXPECT_TRUE(same_bits(eight.color[i], sixteen.color[i])) << i;
    }
  }
}

TEST(DifferentiateTile, GivesTheSameBitsWithEightAndWithSixteenLanes) {
  if (!has_sixteen_lanes()) GTEST_SKIP() << "this processor has no AVX-512 (F, DQ and VL)";
  const std::vector<std::array<int, 2>> sizes = {kWhole, {5, 3}, {1, 16}, {16, 1}};
  for (const std::array<int, 2> size : sizes) {
    for (unsigned kind = 0; kind < 16; ++kind) {
      const LossChannels channels{.color = (kind & 1) != 0 || (kind & 4) != 0,
                                  .depth = (kind & 2) != 0,
                                  .color_derivative = (kind & 4) != 0,
                                  .weight_squares = (kind & 8) != 0};
      SCOPED_TRACE(testing::Message() << size[0] << " x " << size[1] << ", channels " << kind);
      expect_same_bits(random_tile(300, size, 10 + kind), channels);
    }
  }
}

}  // namespace
}  // namespace cgs::tile_gradient_test
