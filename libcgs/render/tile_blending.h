// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "libcgs/render/projection.h"

namespace cgs {

inline constexpr int kTileSize = 16;               ///< Edge of a tile [pixels].
inline constexpr float kMaxSplatAlpha = 0.99f;     ///< Upper bound of one splat's opacity.
inline constexpr float kMinTransmittance = 1e-4f;  ///< Pixels that let less through are finished.

/// A splat as one row of tiles needs it; fills a cache line.
struct alignas(64) BandSplat {
  double x = 0;     ///< Where dx - slope * dy vanishes on the first pixel row of the band.
  float slope = 0;  ///< Shift of that place per pixel row.
  float dy = 0;     ///< First pixel row of the band minus the centre [pixels].
  float inv_sigma_y = 0;
  float inv_sigma_x = 0;
  float sigma_x = 0;
  float q_max = 0;
  float opacity = 0;
  float depth = 0;
  std::array<float, 3> color{};
  RowRange rows;       ///< Pixel rows of the band that the splat can reach.
  uint32_t index = 0;  ///< Of the Gaussian in its set.
};

/// What blending accumulates over the pixels of one tile, row-major.
struct alignas(32) TileAccumulator {
  static constexpr size_t kPixels = size_t{kTileSize} * kTileSize;
  using Plane = std::array<float, kPixels>;
  Plane transmittance;
  std::array<Plane, 3> color;
  Plane first_depth;   ///< Depth of the first Gaussian; the two sums below are relative to it.
  Plane depth_sum;     ///< Sum w (z - first)
  Plane depth_square;  ///< Sum w (z - first)^2
  Plane weight_square;
  Plane last_above_half;  ///< Depth of the last Gaussian blended while transmittance was > 0.5.
  Plane best_weight;
  std::array<int32_t, kPixels> strongest;  ///< -1 = none.
};

/// The splat seen from a band of kTileSize pixel rows that starts at pixel row `first_row`.
///
/// \param rows   pixel rows of the image that the splat can reach
/// \param index  of its Gaussian
inline BandSplat in_band(const Splat& splat, RowRange rows, uint32_t index, int first_row) {
  BandSplat out;
  const double dy = first_row + 0.5 - splat.v;
  out.x = splat.u + splat.slope * dy;
  out.slope = static_cast<float>(splat.slope);
  out.dy = static_cast<float>(dy);
  out.inv_sigma_y = splat.inv_sigma_y;
  out.inv_sigma_x = 1.0f / splat.sigma_x;
  out.sigma_x = splat.sigma_x;
  out.q_max = splat.q_max;
  out.opacity = splat.opacity;
  out.depth = splat.depth;
  out.color = {splat.color.x(), splat.color.y(), splat.color.z()};
  out.rows = {std::max(rows.first - first_row, 0), std::min(rows.last - first_row, kTileSize - 1)};
  out.index = index;
  return out;
}

/// Number of tiles that cover so many pixels.
inline int tiles_in(int pixels) { return (pixels + kTileSize - 1) / kTileSize; }

/// e^(-q / 2) = 2^(q * kLog2OfGaussian)
inline constexpr float kLog2OfGaussian = -0.5f * 1.44269504f;

/// Exponent of the pixel centre nearest to the ridge among the eight from `first` on.
inline float least_exponent(float ridge, float first, float inv_sigma_x) {
  const float t = std::max({first + 0.5f - ridge, ridge - (first + 7.5f), 0.0f}) * inv_sigma_x;
  return t * t;
}

/// Inclusive range of columns of tiles; empty when first > last.
struct TileRange {
  int32_t first, last;
};

/// Columns, of `columns` in all, whose tiles the support of a splat reaches within its band.
TileRange tiles_reached(const Splat& splat, const BandSplat& in_band, int columns);

/// Blends splats, nearest first, over the tile whose first pixel column is `first_column`.
///
/// Only the leading `width` x `height` pixels of the tile belong to the image.
/// Subnormal numbers count as zero inside, whatever the mode of the calling thread.
void blend_tile(std::span<const BandSplat> band,
                std::span<const uint32_t> nearest_first,
                int first_column,
                std::array<int, 2> size,
                TileAccumulator& tile);

}  // namespace cgs
