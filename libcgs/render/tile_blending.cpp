// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/tile_blending.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libcgs/core/lanes.h"

namespace cgs {

namespace {

// Blends eight pixels from `at` on; distance is that of the first from the ridge of the splat.
inline void blend_window(
    const BandSplat& s, float row_exponent, float distance, int at, TileAccumulator& tile) {
  constexpr Floats kLane = {0, 1, 2, 3, 4, 5, 6, 7};
  constexpr Floats kZero = {};
  constexpr Floats kHighestExponent = kZero + 100.0f;  // far below the cut
  const Floats t = (kLane + distance) * s.inv_sigma_x;
  const Floats q = min(t * t + row_exponent, kHighestExponent);
  Floats alpha = min(s.opacity * exp2_negative(q * kLog2OfGaussian), kZero + kMaxSplatAlpha);

  const Floats before = load<Floats>(&tile.transmittance[at]);
  const Ints blended = (alpha >= kMinSplatAlpha) & (before >= kMinTransmittance);
  alpha = blended ? alpha : kZero;
  const Floats w = alpha * before;
  store(before * (1.0f - alpha), &tile.transmittance[at]);
  for (int c = 0; c < 3; ++c) {
    store(load<Floats>(&tile.color[c][at]) + w * s.color[c], &tile.color[c][at]);
  }
  store(load<Floats>(&tile.weight_square[at]) + w * w, &tile.weight_square[at]);

  const Floats depth = kZero + s.depth;
  const Floats best = load<Floats>(&tile.best_weight[at]);
  // Up to and including the first Gaussian that leaves any weight.
  const Floats first = best == kZero ? depth : load<Floats>(&tile.first_depth[at]);
  store(first, &tile.first_depth[at]);
  const Floats z = depth - first;
  const Floats wz = w * z;
  store(load<Floats>(&tile.depth_sum[at]) + wz, &tile.depth_sum[at]);
  store(load<Floats>(&tile.depth_square[at]) + wz * z, &tile.depth_square[at]);

  const Ints above_half = blended & (before > 0.5f);
  const Floats last = load<Floats>(&tile.last_above_half[at]);
  store(above_half ? depth : last, &tile.last_above_half[at]);
  const Ints stronger = w > best;
  store(stronger ? w : best, &tile.best_weight[at]);
  const Ints strongest = load<Ints>(&tile.strongest[at]);
  store(stronger ? Ints{} + static_cast<int32_t>(s.index) : strongest, &tile.strongest[at]);
}

void blend_splat(const BandSplat& s, int first_column, uint32_t open_rows, TileAccumulator& tile) {
  const auto ridge_at_top = static_cast<float>(s.x - first_column);
  for (int row = s.rows.first; row <= s.rows.last; ++row) {
    const auto r = static_cast<float>(row);
    const float ty = (s.dy + r) * s.inv_sigma_y;
    const float rest = s.q_max - ty * ty;
    if (rest < 0 || (open_rows >> row & 1U) == 0) continue;
    const float ridge = ridge_at_top + s.slope * r;
    const int at = row * kTileSize;
    // Fixed halves of the row: windows that overlap the last ones by parts would have to wait until
    // those are written back.
    if (least_exponent(ridge, 0, s.inv_sigma_x) <= rest) {
      blend_window(s, ty * ty, 0.5f - ridge, at, tile);
    }
    if (least_exponent(ridge, kLanes, s.inv_sigma_x) <= rest) {
      blend_window(s, ty * ty, (kLanes + 0.5f) - ridge, at + kLanes, tile);
    }
  }
}

// Bit r is set while pixel row r has a pixel that is not finished.
uint32_t unfinished_rows(const TileAccumulator& tile) {
  uint32_t rows = 0;
  for (int row = 0; row < kTileSize; ++row) {
    const float* T = &tile.transmittance[size_t{kTileSize} * row];
    const float clearest = *std::max_element(T, T + kTileSize);
    rows |= static_cast<uint32_t>(clearest >= kMinTransmittance) << row;
  }
  return rows;
}

void reset(TileAccumulator& tile, std::array<int, 2> size) {
  tile.transmittance.fill(0);  // pixels beyond the image are finished from the start
  for (int y = 0; y < size[1]; ++y) {
    std::fill_n(&tile.transmittance[size_t{kTileSize} * y], size[0], 1.0f);
  }
  for (TileAccumulator::Plane& plane : tile.color) plane.fill(0);
  tile.first_depth.fill(0);
  tile.depth_sum.fill(0);
  tile.depth_square.fill(0);
  tile.weight_square.fill(0);
  tile.last_above_half.fill(std::numeric_limits<float>::quiet_NaN());
  tile.best_weight.fill(0);
  tile.strongest.fill(-1);
}

}  // namespace

TileRange tiles_reached(const Splat& s, const BandSplat& b, int columns) {
  double left = s.u - double(s.half_width);
  double right = s.u + double(s.half_width);
  if (right - left > 2 * kTileSize) {
    // A long needle crosses a band in a short stretch. The outermost points of an ellipse lie
    // where the shift along the ridge, slope * dy, is in balance with the narrowing; outside the
    // band the nearest row inside takes their place.
    const double q = double(b.q_max);
    const double sigma_y = 1.0 / double(b.inv_sigma_y);
    const double sigma_x = double(b.sigma_x);
    const double dy_top = b.dy;
    const double dy_bottom = b.dy + float(kTileSize - 1);
    const double balance = q * s.slope * sigma_y * sigma_y / double(s.half_width);
    const auto edge = [&](double sign) {
      const double dy = std::clamp(sign * balance, dy_top, dy_bottom);
      const double t = dy / sigma_y;
      return s.u + s.slope * dy + sign * std::sqrt(std::max(q - t * t, 0.0)) * sigma_x;
    };
    left = edge(-1);
    right = edge(1);
  }
  // One more pixel on each side, against rounding.
  const double first = std::floor((left - 1) / kTileSize);
  const double last = std::floor((right + 1) / kTileSize);
  return {static_cast<int32_t>(std::clamp(first, 0.0, double(columns))),
          static_cast<int32_t>(std::clamp(last, -1.0, columns - 1.0))};
}

void blend_tile(std::span<const BandSplat> band,
                std::span<const uint32_t> nearest_first,
                int first_column,
                std::array<int, 2> size,
                TileAccumulator& tile) {
  const FlushSubnormals flush;
  reset(tile, size);
  constexpr size_t kCheckEvery = 32;  // splats between two looks at which rows are finished
  uint32_t open_rows = unfinished_rows(tile);
  for (size_t i = 0; i < nearest_first.size() && open_rows != 0; ++i) {
    blend_splat(band[nearest_first[i]], first_column, open_rows, tile);
    if (i % kCheckEvery == kCheckEvery - 1) open_rows = unfinished_rows(tile);
  }
}

}  // namespace cgs
