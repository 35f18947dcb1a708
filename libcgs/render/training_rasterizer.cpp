// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/training_rasterizer.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "libcgs/core/error.h"
#include "libcgs/render/depth_sort.h"
#include "libcgs/render/projection_gradient.h"
#include "libcgs/render/spherical_harmonics.h"
#include "libcgs/render/tile_gradient.h"

namespace cgs {

namespace {

constexpr size_t kBlock = 4096;  // Gaussians that one task projects or differentiates

// One row of tiles.
struct TrainingBand {
  std::vector<TileEntry> in_tiles;  // tile by tile, nearest first
  std::vector<size_t> begin;        // per tile, and the end of the last
  std::vector<uint64_t> keys;
  std::vector<uint64_t> scratch;
};

// What the splats of one row of tiles leave behind on the way back, before it is added up.
struct BandRecords {
  std::vector<uint32_t> place;
  std::vector<SplatMoments> moments;
  std::vector<ColorDerivative> color;
};

struct GaussianMoments {
  std::array<double, 8> moments{};  // as in SplatMoments
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
};

SplatGradient splat_gradient(const Splat& splat, const GaussianMoments& sum) {
  const double per_sigma_x = 1 / double(splat.sigma_x);
  const double per_sigma_y = splat.inv_sigma_y;
  const double shear = splat.slope * per_sigma_x;
  const auto [m, t, ty, t_t, t_ty, ty_ty, depth, unused] = sum.moments;
  // C^-1 d = (t / sigma_x, ty / sigma_y - slope t / sigma_x); dL/dC is half the sum of m times its
  // outer product.
  return {.u = t * per_sigma_x,
          .v = ty * per_sigma_y - t * shear,
          .cov_xx = 0.5 * t_t * per_sigma_x * per_sigma_x,
          .cov_xy = (t_ty * per_sigma_y - t_t * shear) * per_sigma_x,
          .cov_yy = 0.5 * (ty_ty * per_sigma_y * per_sigma_y - 2 * t_ty * per_sigma_y * shear +
                           t_t * shear * shear),
          .depth = depth};
}

void check_balls(const Gaussians& g, size_t begin, size_t end) {
  for (size_t i = begin; i < end; ++i) {
    const Eigen::Vector3f& s = g.scale[i];
    const bool ball = (s.x() == s.y() && s.x() == s.z()) || !std::isfinite(s.sum());
    require(ball, "TrainingRasterizer: balls must have three equal scales", s.transpose());
  }
}

template <typename T>
void match_size(std::vector<T>& values, size_t size, const T& zero) {
  if (values.empty()) values.assign(size, zero);
  require(values.size() == size, "GaussianGradients: one entry per Gaussian", values.size());
}

void check_loss(const Raster<float>& loss, const Camera& camera) {
  require(loss.empty() || (loss.width == camera.width && loss.height == camera.height),
          "TrainingRasterizer: gradients must be of the size of the image",
          loss.width);
}

}  // namespace

struct TrainingRasterizer::Tape {
  TrainingRasterizerOptions options;
  const Gaussians* gaussians = nullptr;
  ProjectionView view;
  ProjectedGaussians projected;
  int rows = 0;     // of tiles
  int columns = 0;  // of tiles
  // Entries (Gaussian, row of tiles), row by row, each in index order. A block of Gaussians owns
  // a stretch of every row, from cursor[block * rows + row] on.
  std::vector<size_t> row_begin;
  std::vector<size_t> cursor;
  std::vector<BandSplat> splats;
  std::vector<TileRange> reach;
  std::vector<SplatMoments> moments;
  std::vector<ColorDerivative> color_derivatives;
  std::vector<TrainingBand> bands;
  std::vector<TileEnd> ends;
  TrainingBuffers out;
  tbb::enumerable_thread_specific<BandRecords> records;

  size_t block_count() const { return (gaussians->size() + kBlock - 1) / kBlock; }
  std::array<int, 2> tile_size(int column, int row) const {
    return {std::min(kTileSize, view.camera.width - column * kTileSize),
            std::min(kTileSize, view.camera.height - row * kTileSize)};
  }
  size_t band_size(int row) const { return row_begin[row + 1] - row_begin[row]; }
  TileSplats tile_splats(int column, int row);

  template <typename Visit>
  void for_each_entry(size_t block, Visit visit) const;
  void count_entries();
  void pack_entries();
  void bin_into_tiles(int row);
  void draw(int column, int row);
  void resize_outputs();

  void read_loss(const TrainingBuffers& loss, int column, int row, TileLoss& tile) const;
  void differentiate_row(const TrainingBuffers& loss, LossChannels channels, int row);
  void add_block(size_t block, LossChannels channels, GaussianGradients& sum) const;
  void add_color(size_t i, const Eigen::Vector3d& of_color, GaussianGradients& sum) const;
  void prepare(GaussianGradients& sum) const;
};

TileSplats TrainingRasterizer::Tape::tile_splats(int column, int row) {
  TrainingBand& band = bands[row];
  const size_t begin = band.begin[column];
  return {std::span(splats).subspan(row_begin[row], band_size(row)),
          std::span(band.in_tiles).subspan(begin, band.begin[column + 1] - begin),
          column * kTileSize};
}

// Calls visit(Gaussian, row, entry) for the entries of a block; Gaussians in index order.
template <typename Visit>
void TrainingRasterizer::Tape::for_each_entry(size_t block, Visit visit) const {
  std::vector<size_t> next(cursor.begin() + static_cast<ptrdiff_t>(block) * rows,
                           cursor.begin() + static_cast<ptrdiff_t>(block + 1) * rows);
  const size_t end = std::min(gaussians->size(), (block + 1) * kBlock);
  for (size_t i = block * kBlock; i < end; ++i) {
    if (projected.fate[i] != SplatFate::Drawn) continue;
    const RowRange range = projected.rows[i];
    for (int r = range.first / kTileSize; r <= range.last / kTileSize; ++r) visit(i, r, next[r]++);
  }
}

void TrainingRasterizer::Tape::count_entries() {
  const size_t blocks = block_count();
  cursor.assign(blocks * static_cast<size_t>(rows), 0);
  std::vector<std::vector<size_t>> counts(blocks);
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    const size_t end = std::min(gaussians->size(), (block + 1) * kBlock);
    if (options.shape == GaussianShape::Balls) check_balls(*gaussians, block * kBlock, end);
    counts[block].assign(rows, 0);
    for_each_entry(block, [&](size_t, int r, size_t) { ++counts[block][r]; });
  });
  row_begin.clear();
  size_t total = 0;
  for (int r = 0; r < rows; ++r) {
    row_begin.push_back(total);
    for (size_t block = 0; block < blocks; ++block) {
      cursor[block * static_cast<size_t>(rows) + static_cast<size_t>(r)] = total;
      total += counts[block][r];
    }
  }
  row_begin.push_back(total);
  constexpr size_t kMaxEntries = size_t{1} << 26;
  if (total > kMaxEntries) {
    throw LimitError("TrainingRasterizer: the splats cover " + std::to_string(total) +
                     " rows of tiles in all, more than " + std::to_string(kMaxEntries));
  }
}

void TrainingRasterizer::Tape::pack_entries() {
  splats.resize(row_begin.back());
  reach.resize(row_begin.back());
  tbb::parallel_for(size_t{0}, block_count(), [&](size_t block) {
    for_each_entry(block, [&](size_t i, int row, size_t entry) {
      const Splat& splat = projected.splats[i];
      splats[entry] = in_band(splat, projected.rows[i], static_cast<uint32_t>(i), row * kTileSize);
      reach[entry] = tiles_reached(splat, splats[entry], columns);
    });
  });
}

void TrainingRasterizer::Tape::bin_into_tiles(int row) {
  TrainingBand& band = bands[row];
  const size_t first = row_begin[row];
  const size_t count = band_size(row);
  band.keys.resize(count);
  band.begin.assign(static_cast<size_t>(columns) + 1, 0);
  for (size_t k = 0; k < count; ++k) {
    band.keys[k] = depth_key(splats[first + k].depth, static_cast<uint32_t>(k));
    const TileRange tiles = reach[first + k];
    for (int c = tiles.first; c <= tiles.last; ++c) ++band.begin[c + 1];
  }
  sort_depth_keys(band.keys, band.scratch);
  for (int c = 0; c < columns; ++c) band.begin[c + 1] += band.begin[c];
  band.in_tiles.resize(band.begin.back());
  std::vector<size_t> next = band.begin;
  for (const uint64_t key : band.keys) {
    const uint32_t k = index_of_key(key);
    const TileRange tiles = reach[first + k];
    for (int c = tiles.first; c <= tiles.last; ++c) band.in_tiles[next[c]++].splat = k;
  }
}

void TrainingRasterizer::Tape::resize_outputs() {
  const int width = view.camera.width;
  const int height = view.camera.height;
  const auto match = [&](Raster<float>& raster, bool is_drawn) {
    if (!is_drawn) {
      raster = {};
    } else if (raster.width != width || raster.height != height) {
      raster = {width, height, 0};
    }
  };
  for (Raster<float>& plane : out.color) match(plane, true);
  match(out.alpha, true);
  match(out.depth_sum, options.depth_sums);
  match(out.depth_square_sum, options.depth_sums);
  match(out.weight_square_sum, options.weight_squares);
}

void TrainingRasterizer::Tape::draw(int column, int row) {
  const std::array<int, 2> size = tile_size(column, row);
  TileEnd& end =
      ends[static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column)];
  TileSums sums;
  sums.has_depths = options.depth_sums;
  sums.has_weight_squares = options.weight_squares;
  draw_tile(tile_splats(column, row), size, end, sums);
  for (int y = 0; y < size[1]; ++y) {
    const size_t to = out.alpha.index(column * kTileSize, row * kTileSize + y);
    for (int x = 0; x < size[0]; ++x) {
      const size_t from = tile_index(x, y);
      const float T = end.transmittance[from];
      for (int c = 0; c < 3; ++c) {
        out.color[c].data[to + x] = sums.color[c][from] + T * options.background[c];
      }
      out.alpha.data[to + x] = 1.0f - T;
      if (options.depth_sums) {
        out.depth_sum.data[to + x] = sums.depth[from];
        out.depth_square_sum.data[to + x] = sums.depth_square[from];
      }
      if (options.weight_squares) out.weight_square_sum.data[to + x] = sums.weight_square[from];
    }
  }
}

void TrainingRasterizer::Tape::read_loss(const TrainingBuffers& loss,
                                         int column,
                                         int row,
                                         TileLoss& tile) const {
  const std::array<int, 2> size = tile_size(column, row);
  const auto read = [&](const Raster<float>& raster, TilePlane& plane) {
    plane.fill(0);
    if (raster.empty()) return;
    for (int y = 0; y < size[1]; ++y) {
      const float* from = &raster.data[raster.index(column * kTileSize, row * kTileSize + y)];
      for (int x = 0; x < size[0]; ++x) plane[tile_index(x, y)] = from[x];
    }
  };
  read(loss.alpha, tile.transmittance);
  for (float& of_transmittance : tile.transmittance) of_transmittance = -of_transmittance;
  read(loss.depth_sum, tile.depth_sum);
  read(loss.depth_square_sum, tile.depth_square_sum);
  read(loss.weight_square_sum, tile.weight_square_sum);
  for (int c = 0; c < 3; ++c) {
    read(loss.color[c], tile.color[c]);
    if (options.background[c] == 0) continue;
    for (size_t p = 0; p < kTilePixels; ++p) {
      tile.transmittance[p] += options.background[c] * tile.color[c][p];
    }
  }
}

void TrainingRasterizer::Tape::differentiate_row(const TrainingBuffers& loss,
                                                 LossChannels channels,
                                                 int row) {
  const size_t first = row_begin[row];
  const size_t count = band_size(row);
  BandRecords& band = records.local();
  band.place.resize(count);
  uint32_t total = 0;
  for (size_t k = 0; k < count; ++k) {
    const TileRange tiles = reach[first + k];
    band.place[k] = total - static_cast<uint32_t>(tiles.first);
    if (tiles.first <= tiles.last) total += static_cast<uint32_t>(tiles.last - tiles.first + 1);
  }
  if (band.moments.size() < total) band.moments.resize(total);
  if (channels.color_derivative && band.color.size() < total) band.color.resize(total);
  // Isolated, so that this thread does not meanwhile start another row with the same memory.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(0, columns, [&](int column) {
      TileLoss tile;
      read_loss(loss, column, row, tile);
      differentiate_tile(tile_splats(column, row),
                         ends[static_cast<size_t>(row) * static_cast<size_t>(columns) +
                              static_cast<size_t>(column)],
                         tile,
                         channels,
                         {band.place, static_cast<uint32_t>(column), band.moments, band.color});
    });
  });
  using Lanes = Eigen::Array<float, 8, 1>;
  for (size_t k = 0; k < count; ++k) {
    Lanes sum = Lanes::Zero();
    Eigen::Array4f color = Eigen::Array4f::Zero();
    for (int c = reach[first + k].first; c <= reach[first + k].last; ++c) {
      const uint32_t record = band.place[k] + static_cast<uint32_t>(c);
      sum += Eigen::Map<const Lanes>(band.moments[record].sum.data());
      if (channels.color_derivative) {
        color += Eigen::Map<const Eigen::Array4f>(band.color[record].data());
      }
    }
    Eigen::Map<Lanes>(moments[first + k].sum.data()) = sum;
    if (channels.color_derivative) {
      Eigen::Map<Eigen::Array4f>(color_derivatives[first + k].data()) = color;
    }
  }
}

void TrainingRasterizer::Tape::prepare(GaussianGradients& sum) const {
  const size_t n = gaussians->size();
  match_size<Eigen::Vector3f>(sum.position, n, Eigen::Vector3f::Zero());
  match_size(sum.opacity, n, 0.0f);
  if (options.shape == GaussianShape::Balls) {
    match_size(sum.radius, n, 0.0f);
  } else {
    match_size<CovarianceGradient>(sum.covariance, n, CovarianceGradient::Zero());
  }
  if (options.sh_gradients) {
    match_size<Eigen::Vector3f>(sum.sh, gaussians->sh.size(), Eigen::Vector3f::Zero());
  }
  if (options.image_place_gradients) {
    match_size<Eigen::Vector2f>(sum.image_place, n, Eigen::Vector2f::Zero());
  }
}

void TrainingRasterizer::Tape::add_color(size_t i,
                                         const Eigen::Vector3d& of_color,
                                         GaussianGradients& sum) const {
  const Gaussians& g = *gaussians;
  const auto count = static_cast<size_t>(g.sh_count());
  // Nothing passes the cut at zero.
  const Eigen::Vector3f of_sum =
      (projected.splats[i].color.array() > 0).select(of_color.cast<float>().array(), 0.0f);
  if (g.sh_degree == 0) {
    if (options.sh_gradients) sum.sh[i] += kShC0 * of_sum;
    return;
  }
  const Eigen::Vector3d from_center = g.position[i].cast<double>() - view.center;
  const double distance = from_center.norm();
  const Eigen::Vector3d direction = from_center / distance;
  const ShBasis basis = sh_basis(g.sh_degree, direction.cast<float>());
  Eigen::Vector3d of_direction = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < count; ++k) {
    if (options.sh_gradients) sum.sh[i * count + k] += basis.value[k] * of_sum;
    of_direction += double(g.sh[i * count + k].dot(of_sum)) * basis.slope[k].cast<double>();
  }
  const Eigen::Vector3d along = of_direction - direction * direction.dot(of_direction);
  sum.position[i] += (along / distance).cast<float>();
}

void TrainingRasterizer::Tape::add_block(size_t block,
                                         LossChannels channels,
                                         GaussianGradients& sum) const {
  const Gaussians& g = *gaussians;
  const auto finish = [&](size_t i, const GaussianMoments& total) {
    const Splat& splat = projected.splats[i];
    const SplatGradient gradient = splat_gradient(splat, total);
    if (options.image_place_gradients) {
      sum.image_place[i] += Eigen::Vector2d(gradient.u, gradient.v).cast<float>();
    }
    if (g.opacity[i] <= 1) {
      sum.opacity[i] += static_cast<float>(total.moments[0] / double(g.opacity[i]));
    }
    if (options.shape == GaussianShape::Balls) {
      const BallGradient of = ball_gradient(view, splat, g.scale[i].x(), gradient);
      sum.position[i] += of.position.cast<float>();
      sum.radius[i] += static_cast<float>(of.radius);
    } else {
      const EllipsoidGradient of =
          ellipsoid_gradient(view, splat, g.scale[i], g.rotation[i], gradient);
      sum.position[i] += of.position.cast<float>();
      sum.covariance[i] += of.covariance;
    }
    if (channels.color_derivative) add_color(i, total.color, sum);
  };
  GaussianMoments total;
  for_each_entry(block, [&](size_t i, int row, size_t entry) {
    for (size_t k = 0; k < total.moments.size(); ++k) {
      total.moments[k] += double(moments[entry].sum[k]);
    }
    if (channels.color_derivative) {
      total.color +=
          Eigen::Map<const Eigen::Vector3f>(color_derivatives[entry].data()).cast<double>();
    }
    if (row != projected.rows[i].last / kTileSize) return;
    finish(i, total);
    total = {};
  });
}

void TrainingRasterizerOptions::validate() const {
  require(std::isfinite(background.sum()),
          "TrainingRasterizerOptions.background must be finite",
          background.transpose());
  ProjectionOptions{.dilation = dilation, .near_depth = near_depth}.validate();
}

TrainingRasterizer::TrainingRasterizer(const TrainingRasterizerOptions& options)
    : tape_(std::make_unique<Tape>()) {
  set_options(options);
}
TrainingRasterizer::~TrainingRasterizer() = default;
TrainingRasterizer::TrainingRasterizer(TrainingRasterizer&&) noexcept = default;
TrainingRasterizer& TrainingRasterizer::operator=(TrainingRasterizer&&) noexcept = default;

void TrainingRasterizer::set_options(const TrainingRasterizerOptions& options) {
  options.validate();
  tape_->options = options;
}

const TrainingBuffers& TrainingRasterizer::forward(const Gaussians& gaussians,
                                                   const Camera& camera) {
  Tape& tape = *tape_;
  tape.gaussians = &gaussians;
  project_gaussians(
      gaussians, camera, {tape.options.dilation, tape.options.near_depth}, tape.projected);
  tape.view = projection_view(camera);
  tape.rows = tiles_in(camera.height);
  tape.columns = tiles_in(camera.width);
  tape.count_entries();
  tape.pack_entries();
  tape.resize_outputs();
  tape.bands.resize(tape.rows);
  tape.ends.resize(static_cast<size_t>(tape.rows) * static_cast<size_t>(tape.columns));
  tbb::parallel_for(0, tape.rows, [&](int row) {
    tape.bin_into_tiles(row);
    tbb::parallel_for(0, tape.columns, [&](int column) { tape.draw(column, row); });
  });
  return tape.out;
}

const ProjectedGaussians& TrainingRasterizer::projected() const { return tape_->projected; }

void TrainingRasterizer::backward(const TrainingBuffers& loss, GaussianGradients& sum) {
  Tape& tape = *tape_;
  require(tape.gaussians != nullptr, "TrainingRasterizer: forward() must come first", 0);
  const bool color = !loss.color[0].empty() || !loss.color[1].empty() || !loss.color[2].empty();
  const bool depth = !loss.depth_sum.empty() || !loss.depth_square_sum.empty();
  for (const Raster<float>* raster : {&loss.color[0],
                                      &loss.color[1],
                                      &loss.color[2],
                                      &loss.alpha,
                                      &loss.depth_sum,
                                      &loss.depth_square_sum,
                                      &loss.weight_square_sum}) {
    check_loss(*raster, tape.view.camera);
  }
  tape.prepare(sum);
  const bool squares = !loss.weight_square_sum.empty();
  if (!color && !depth && !squares && loss.alpha.empty()) return;
  const bool color_derivative =
      color && (tape.options.sh_gradients || tape.gaussians->sh_degree > 0);
  const LossChannels channels{color, depth, color_derivative, squares};
  tape.moments.resize(tape.splats.size());
  if (color_derivative) tape.color_derivatives.resize(tape.splats.size());
  tbb::parallel_for(0, tape.rows, [&](int row) { tape.differentiate_row(loss, channels, row); });
  tbb::parallel_for(
      size_t{0}, tape.block_count(), [&](size_t block) { tape.add_block(block, channels, sum); });
}

}  // namespace cgs
