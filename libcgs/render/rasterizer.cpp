// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/rasterizer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/render/tile_blending.h"

namespace cgs {

namespace {

// The Gaussians that reach each row of tiles, nearest first. Tiles sort out their share row by
// row, so that the memory needed grows with the rows a splat covers and not with its area.
struct TileRows {
  std::vector<uint32_t> gaussians;
  std::vector<size_t> begin;  // per row of tiles, and the end of the last

  std::span<const uint32_t> row(int r) const {
    return std::span(gaussians).subspan(begin[r], begin[r + 1] - begin[r]);
  }
};

TileRows sort_into_rows(const ProjectedGaussians& projected,
                        const std::vector<uint32_t>& order,
                        int row_count) {
  // Blocks of the order fill disjoint parts of each row's list, one after the other.
  constexpr size_t kBlock = size_t{1} << 14;
  const size_t blocks = (order.size() + kBlock - 1) / kBlock;
  const auto for_each_row_of_block = [&](size_t block, const auto& visit) {
    const size_t end = std::min(order.size(), (block + 1) * kBlock);
    for (size_t k = block * kBlock; k < end; ++k) {
      const RowRange rows = projected.rows[order[k]];
      for (int r = rows.first / kTileSize; r <= rows.last / kTileSize; ++r) visit(r, order[k]);
    }
  };
  std::vector<std::vector<size_t>> cursor(blocks, std::vector<size_t>(row_count, 0));
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    for_each_row_of_block(block, [&](int r, uint32_t) { ++cursor[block][r]; });
  });
  TileRows out;
  size_t total = 0;
  for (int r = 0; r < row_count; ++r) {
    out.begin.push_back(total);
    for (size_t block = 0; block < blocks; ++block) {
      const size_t count = cursor[block][r];
      cursor[block][r] = total;
      total += count;
    }
  }
  out.begin.push_back(total);
  constexpr size_t kMaxEntries = size_t{1} << 30;
  if (total > kMaxEntries) {
    throw LimitError("rasterize: the splats cover " + std::to_string(total) +
                     " rows of tiles in all, more than " + std::to_string(kMaxEntries));
  }
  out.gaussians.resize(total);
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    for_each_row_of_block(block, [&](int r, uint32_t g) { out.gaussians[cursor[block][r]++] = g; });
  });
  return out;
}

// One row of tiles, ready to blend.
struct Band {
  std::vector<BandSplat> splats;   // nearest first
  std::vector<uint32_t> in_tiles;  // positions in splats, tile by tile, nearest first
  std::vector<size_t> begin;       // per tile, and the end of the last
};

Band make_band(const ProjectedGaussians& projected,
               std::span<const uint32_t> gaussians,
               int row,
               int columns) {
  Band band;
  band.splats.reserve(gaussians.size());
  std::vector<TileRange> reach;
  reach.reserve(gaussians.size());
  band.begin.assign(static_cast<size_t>(columns) + 1, 0);
  for (size_t k = 0; k < gaussians.size(); ++k) {
    // Depth order visits the splats at random, faster than memory can follow unasked.
    constexpr size_t kAhead = 16;
    const uint32_t coming = gaussians[std::min(k + kAhead, gaussians.size() - 1)];
    __builtin_prefetch(&projected.splats[coming]);
    __builtin_prefetch(&projected.rows[coming]);
    const uint32_t g = gaussians[k];
    const Splat& splat = projected.splats[g];
    band.splats.push_back(in_band(splat, projected.rows[g], g, row * kTileSize));
    reach.push_back(tiles_reached(splat, band.splats.back(), columns));
    for (int c = reach.back().first; c <= reach.back().last; ++c) ++band.begin[c + 1];
  }
  for (int c = 0; c < columns; ++c) band.begin[c + 1] += band.begin[c];
  band.in_tiles.resize(band.begin.back());
  std::vector<size_t> cursor = band.begin;
  for (uint32_t k = 0; k < reach.size(); ++k) {
    for (int c = reach[k].first; c <= reach[k].last; ++c) band.in_tiles[cursor[c]++] = k;
  }
  return band;
}

void write_pixel(const TileAccumulator& tile,
                 int at,
                 size_t to,
                 const RasterizerOptions& options,
                 RenderBuffers& out) {
  const float T = tile.transmittance[at];
  const float alpha = 1.0f - T;
  out.alpha.data[to] = alpha;
  out.color.data[to] = Eigen::Vector3f(tile.color[0][at], tile.color[1][at], tile.color[2][at]) +
                       T * options.background;
  if (T <= 0.5f) out.median_depth.data[to] = tile.last_above_half[at];
  out.weight_squared.data[to] = tile.weight_square[at];
  out.strongest.data[to] = static_cast<uint32_t>(tile.strongest[at]);
  if (!(alpha >= options.min_alpha)) return;
  // Relative to the first Gaussian the variance keeps its digits: either all depths lie close to
  // it, or its own weight, at least 1/255, makes the variance large.
  const float mean = tile.depth_sum[at] / alpha;
  out.depth.data[to] = tile.first_depth[at] + mean;
  out.depth_variance.data[to] = std::max(tile.depth_square[at] / alpha - mean * mean, 0.0f);
}

RenderBuffers empty_buffers(int width, int height) {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  RenderBuffers out;
  out.color = ColorImage(width, height, Eigen::Vector3f::Zero());
  out.alpha = Raster<float>(width, height, 0);
  out.depth = DepthMap(width, height, kUnknown);
  out.median_depth = DepthMap(width, height, kUnknown);
  out.depth_variance = Raster<float>(width, height, 0);
  out.weight_squared = Raster<float>(width, height, 0);
  out.strongest = Raster<uint32_t>(width, height, UINT32_MAX);
  return out;
}

void draw_row(const ProjectedGaussians& projected,
              std::span<const uint32_t> gaussians,
              int row,
              const RasterizerOptions& options,
              RenderBuffers& out) {
  const int columns = tiles_in(out.color.width);
  const Band band = make_band(projected, gaussians, row, columns);
  tbb::parallel_for(0, columns, [&](int column) {
    const int x0 = column * kTileSize;
    const int y0 = row * kTileSize;
    const std::array<int, 2> size = {std::min(kTileSize, out.color.width - x0),
                                     std::min(kTileSize, out.color.height - y0)};
    const size_t begin = band.begin[column];
    const auto in_tile = std::span(band.in_tiles).subspan(begin, band.begin[column + 1] - begin);
    TileAccumulator tile;
    blend_tile(band.splats, in_tile, x0, size, tile);
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) {
        write_pixel(tile, y * kTileSize + x, out.color.index(x0 + x, y0 + y), options, out);
      }
    }
  });
}

RasterizerReport count_fates(const std::vector<SplatFate>& fates) {
  std::array<size_t, 5> counts{};
  for (const SplatFate fate : fates) ++counts[static_cast<size_t>(fate)];
  return {.drawn = counts[0],
          .degenerate = counts[1],
          .transparent = counts[2],
          .behind = counts[3],
          .outside = counts[4]};
}

}  // namespace

void RasterizerOptions::validate() const {
  require(std::isfinite(background.sum()),
          "RasterizerOptions.background must be finite",
          background.transpose());
  require(
      min_alpha > 0 && min_alpha <= 1, "RasterizerOptions.min_alpha must be in (0, 1]", min_alpha);
  ProjectionOptions{.dilation = dilation, .near_depth = near_depth}.validate();
}

RenderBuffers rasterize(const Gaussians& gaussians,
                        const Camera& camera,
                        const RasterizerOptions& options,
                        RasterizerReport* report) {
  options.validate();
  const ProjectedGaussians projected =
      project_gaussians(gaussians, camera, {options.dilation, options.near_depth});
  const int row_count = tiles_in(camera.height);
  const TileRows rows = sort_into_rows(projected, depth_order(projected), row_count);
  RenderBuffers out = empty_buffers(camera.width, camera.height);
  tbb::parallel_for(
      0, row_count, [&](int row) { draw_row(projected, rows.row(row), row, options, out); });
  if (report != nullptr) *report = count_fates(projected.fate);
  return out;
}

}  // namespace cgs
