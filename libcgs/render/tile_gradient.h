// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "libcgs/core/lanes.h"
#include "libcgs/render/tile_blending.h"

namespace cgs {

inline constexpr size_t kTilePixels = size_t{kTileSize} * kTileSize;

/// The pixels of a tile in blocks of 4 x 4, row-major within a block and block by block: small
/// splats touch fewer squares than stretches of rows.
using TilePlane = std::array<float, kTilePixels>;

/// Position of the pixel in column x, row y of a tile.
constexpr size_t tile_index(int x, int y) {
  const int block = y / 4 * 4 + x / 4;
  return static_cast<size_t>(block) * 16 + static_cast<size_t>(y % 4 * 4 + x % 4);
}

/// A splat of a tile.
struct TileEntry {
  uint32_t splat = 0;    ///< Position in its band.
  uint32_t windows = 0;  ///< Bit i: pixels 8 i ... 8 i + 7 were drawn. Filled by draw_tile().
};

/// The splats of one tile.
struct TileSplats {
  std::span<const BandSplat> band;
  std::span<TileEntry> nearest_first;
  int first_column = 0;  ///< First pixel column of the tile.
  /// Handles 16 pixels at once, which needs has_sixteen_lanes(), or else 8: the bits are the same.
  bool sixteen_lanes = has_sixteen_lanes();
};

/// Where drawing a tile ended, for the way back.
struct alignas(32) TileEnd {
  TilePlane transmittance;
  /// Position in nearest_first of the splat that finished the pixel; INT32_MAX if none did, -1
  /// beyond the image.
  std::array<int32_t, kTilePixels> last;
  uint32_t visited = 0;  ///< Splats of nearest_first that were looked at.
};

/// Sums over the splats at every pixel of a tile.
struct alignas(32) TileSums {
  std::array<TilePlane, 3> color;
  TilePlane depth;          ///< Sum w z; only drawn if has_depths.
  TilePlane depth_square;   ///< Sum w z^2; only drawn if has_depths.
  TilePlane weight_square;  ///< Sum w^2; only drawn if has_weight_squares.
  bool has_depths = false;
  bool has_weight_squares = false;
};

/// Blends splats as blend_tile() does, for training.
///
/// \param size  leading columns and rows of the tile that belong to the image
void draw_tile(const TileSplats& splats, std::array<int, 2> size, TileEnd& end, TileSums& sums);

/// Derivatives of a loss with respect to what a tile shows; zero beyond the image.
struct alignas(32) TileLoss {
  std::array<TilePlane, 3> color;
  TilePlane transmittance;  ///< With respect to 1 - Sum w, which lets the background through.
  TilePlane depth_sum;
  TilePlane depth_square_sum;
  TilePlane weight_square_sum;
};

/// Which planes of TileLoss are not zero, and what is asked for.
struct LossChannels {
  bool color = false;
  bool depth = false;             ///< Any of the two depth sums.
  bool color_derivative = false;  ///< Of the splats; needs color.
  bool weight_squares = false;    ///< As if color and depth were not zero, too.
};

/// Derivatives with respect to one splat over the pixels of a tile, as moments of m = alpha *
/// dL/dalpha: Sum m; m t; m ty; m t^2; m t ty; m ty^2; the derivative with respect to the depth of
/// the splat; 0. Here t = (dx - slope * dy) / sigma_x and ty = dy / sigma_y, so that alpha is
/// opacity * exp(-(t^2 + ty^2) / 2). Moments of one splat in several tiles add up.
struct alignas(32) SplatMoments {
  std::array<float, 8> sum{};
};

/// Derivative with respect to the colour of a splat.
using ColorDerivative = std::array<float, 4>;  ///< The fourth is unused.

/// Where differentiate_tile() writes: one record per splat of nearest_first, anywhere.
struct TileRecords {
  std::span<const uint32_t> place;  ///< Per splat of the band; plus offset gives the record.
  uint32_t offset = 0;              ///< Modulo 2^32.
  std::span<SplatMoments> moments;
  std::span<ColorDerivative> color;  ///< Empty unless channels.color_derivative.
};

/// Walks back over the splats that draw_tile() visited and overwrites the records of all.
///
/// With weights w_i = alpha_i T_i, s_i the derivative of the loss with respect to w_i alone and the
/// background as a last splat of weight T,
///   dL/dalpha_i = T_i s_i - (sum of w_j s_j behind i) / (1 - alpha_i).
/// All weights sum to 1, so s may be taken relative to any value; that of the nearest splat is
/// taken, or digits would cancel between splats that look alike.
void differentiate_tile(const TileSplats& splats,
                        const TileEnd& end,
                        const TileLoss& loss,
                        LossChannels channels,
                        const TileRecords& records);

}  // namespace cgs
