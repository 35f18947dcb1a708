// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/layered_lattice.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr int kRowsPerTask = 8;

// Values of the uniform cubic B-spline at t + 1, t, t - 1, t - 2, for t in [0, 1].
Eigen::Array4f cubic_weights(double t) {
  const double s = 1 - t;
  const Eigen::Array4d six_times(
      s * s * s, 4 + 3 * t * t * (t - 2), 4 + 3 * s * s * (s - 2), t * t * t);
  return (six_times / 6).cast<float>();
}

// A second difference between knots of one layer at one level.
struct SecondDifference {
  int columns, rows;          // how many knots it covers along each axis
  std::array<int, 4> offset;  // of these knots from the first
  std::array<double, 4> factor;
  double weight;  // in the bending energy
};

std::array<SecondDifference, 3> second_differences(int columns) {
  return {SecondDifference{3, 1, {0, 1, 2, 2}, {1, -2, 1, 0}, 1},
          SecondDifference{1, 3, {0, columns, 2 * columns, 2 * columns}, {1, -2, 1, 0}, 1},
          SecondDifference{2, 2, {0, 1, columns, columns + 1}, {1, -1, -1, 1}, 2}};
}

// The knots of one layer at one level.
struct Knots {
  int columns, rows;
  const int32_t* parameter;  // -1 = none
};

// Adds the derivative of `scale` times the sum of squared differences. Returns that sum.
double add_squares(const SecondDifference& difference,
                   const Knots& knots,
                   std::span<const float> parameters,
                   double scale,
                   std::span<float> sum) {
  double squares = 0;
  for (int y = 0; y + difference.rows <= knots.rows; ++y) {
    for (int x = 0; x + difference.columns <= knots.columns; ++x) {
      const int32_t* corner = knots.parameter + size_t(y) * knots.columns + x;
      std::array<int32_t, 4> at{};
      for (int k = 0; k < 4; ++k) at[k] = corner[difference.offset[k]];
      if (*std::min_element(at.begin(), at.end()) < 0) continue;
      double value = 0;
      for (int k = 0; k < 4; ++k) value += difference.factor[k] * double(parameters[at[k]]);
      squares += value * value;
      for (int k = 0; k < 4; ++k) sum[at[k]] += float(2 * scale * value * difference.factor[k]);
    }
  }
  return scale * squares;
}

}  // namespace

void LayeredLatticeOptions::validate() const {
  require(!spacing.empty(), "LayeredLatticeOptions.spacing must have >= 1 levels", spacing.size());
  for (size_t l = 0; l < spacing.size(); ++l) {
    require(spacing[l] >= 2, "LayeredLatticeOptions.spacing must be >= 2 pixels", spacing[l]);
    require(l == 0 || spacing[l] < spacing[l - 1],
            "LayeredLatticeOptions.spacing must fall strictly",
            spacing[l]);
  }
}

LayeredLattice::Axis::Axis(int pixels, int spacing) : knots((pixels - 1) / spacing + 4) {
  for (int i = 0; i < pixels; ++i) {
    first.push_back(i / spacing);
    weight.push_back(cubic_weights((i % spacing + 0.5) / spacing));
  }
}

LayeredLattice::LayeredLattice(const Raster<uint8_t>& layer, const LayeredLatticeOptions& options)
    : layer_(layer) {
  options.validate();
  require(!layer.empty(), "LayeredLattice: number of pixels must be > 0", layer.data.size());
  layers_ = 1 + *std::max_element(layer.data.begin(), layer.data.end());
  size_t count = 0;
  for (const int h : options.spacing) {
    Level level{.x = Axis(layer.width, h), .y = Axis(layer.height, h)};
    level.bending_weight = 1 / (double(h) * h * double(layer.data.size()));
    number_knots(level, count);
    count = level.range.last;
    levels_.push_back(std::move(level));
  }
}

void LayeredLattice::number_knots(Level& level, size_t first) const {
  const size_t columns = level.x.knots;
  const size_t rows = level.y.knots;
  level.parameter.assign(layers_ * rows * columns, -1);
  for (int y = 0; y < layer_.height; ++y) {
    for (int x = 0; x < layer_.width; ++x) {
      int32_t* corner = level.parameter.data() +
                        (layer_(x, y) * rows + level.y.first[y]) * columns + level.x.first[x];
      for (size_t j = 0; j < 4; ++j) std::fill_n(corner + j * columns, 4, 0);
    }
  }
  level.range = {first, first};
  for (int32_t& parameter : level.parameter) {
    if (parameter == 0) parameter = static_cast<int32_t>(level.range.last++);
  }
}

void LayeredLattice::check(size_t parameters) const {
  require(parameters == parameter_count(),
          "LayeredLattice: number of parameters must be parameter_count()",
          parameters);
}

// Sums along y for the pixels of row y: what is left is a spline in x for each layer.
void LayeredLattice::fold(const Level& level, const float* knots, int y, float* folded) const {
  const int columns = level.x.knots;
  const Eigen::Array4f& weight = level.y.weight[y];
  for (int layer = 0; layer < layers_; ++layer) {
    const float* a = knots + (size_t(layer) * level.y.knots + level.y.first[y]) * columns;
    const float* b = a + columns;
    const float* c = b + columns;
    const float* d = c + columns;
    for (int k = 0; k < columns; ++k) {
      folded[k] = weight[0] * a[k] + weight[1] * b[k] + weight[2] * c[k] + weight[3] * d[k];
    }
    folded += columns;
  }
}

// Where the splines in x of all levels begin in one array that holds them one after the other.
std::vector<LayeredLattice::Row> LayeredLattice::rows_in(std::vector<float>& folded) const {
  size_t size = 0;
  for (const Level& level : levels_) size += size_t(layers_) * level.x.knots;
  folded.assign(size, 0);
  std::vector<Row> rows;
  float* begin = folded.data();
  for (const Level& level : levels_) {
    rows.push_back({begin, level.x.first.data(), level.x.weight.data(), level.x.knots});
    begin += size_t(layers_) * level.x.knots;
  }
  return rows;
}

void LayeredLattice::evaluate(std::span<const float> parameters, Raster<float>& value) const {
  check(parameters.size());
  if (value.width != layer_.width || value.height != layer_.height) {
    value = Raster<float>(layer_.width, layer_.height, 0);
  }
  std::vector<std::vector<float>> knots;
  for (const Level& level : levels_) {
    std::vector<float>& of_level = knots.emplace_back();
    of_level.reserve(level.parameter.size());
    for (const int32_t p : level.parameter) of_level.push_back(p < 0 ? 0 : parameters[p]);
  }
  const tbb::blocked_range<int> all(0, layer_.height, kRowsPerTask);
  tbb::parallel_for(all, [&](const tbb::blocked_range<int>& band) {
    std::vector<float> folded;
    const std::vector<Row> rows = rows_in(folded);
    for (int y = band.begin(); y < band.end(); ++y) {
      for (size_t l = 0; l < rows.size(); ++l) fold(levels_[l], knots[l].data(), y, rows[l].folded);
      for (int x = 0; x < layer_.width; ++x) {
        Eigen::Array4f sum = Eigen::Array4f::Zero();
        for (const Row& row : rows) sum += row.at(x, layer_(x, y)) * row.weight[x];
        value(x, y) = sum.sum();
      }
    }
  });
}

void LayeredLattice::add_gradient(const Raster<float>& gradient, std::span<float> sum) const {
  check(sum.size());
  require(gradient.width == layer_.width && gradient.height == layer_.height,
          "LayeredLattice: gradient must have the size of the view",
          gradient.width);
  // Along x first, as evaluate() backwards.
  std::vector<std::vector<float>> folded(layer_.height);
  const tbb::blocked_range<int> all(0, layer_.height, kRowsPerTask);
  tbb::parallel_for(all, [&](const tbb::blocked_range<int>& band) {
    for (int y = band.begin(); y < band.end(); ++y) {
      const std::vector<Row> rows = rows_in(folded[y]);
      for (int x = 0; x < layer_.width; ++x) {
        const float here = gradient(x, y);
        for (const Row& row : rows) row.at(x, layer_(x, y)) += here * row.weight[x];
      }
    }
  });
  size_t begin = 0;
  for (const Level& level : levels_) {
    tbb::parallel_for(
        0, level.y.knots, [&](int knot_row) { gather(level, begin, knot_row, folded, sum); });
    begin += size_t(layers_) * level.x.knots;
  }
}

// Each row of knots collects from the rows of pixels in its support, in their order, so that the
// sum does not depend on which thread does it.
void LayeredLattice::gather(const Level& level,
                            size_t begin_of_level,
                            int knot_row,
                            const std::vector<std::vector<float>>& folded,
                            std::span<float> sum) const {
  const std::vector<int>& first = level.y.first;
  const auto begin = std::lower_bound(first.begin(), first.end(), knot_row - 3);
  const auto end = std::upper_bound(first.begin(), first.end(), knot_row);
  const size_t columns = level.x.knots;
  std::vector<float> total(layers_ * columns, 0);
  for (auto at = begin; at != end; ++at) {
    const std::ptrdiff_t y = at - first.begin();
    const float weight = level.y.weight[y][knot_row - *at];
    const float* row = folded[y].data() + begin_of_level;
    for (size_t k = 0; k < total.size(); ++k) total[k] += weight * row[k];
  }
  for (size_t k = 0; k < total.size(); ++k) {
    const size_t layer = k / columns;
    const size_t knot = (layer * level.y.knots + knot_row) * columns + k % columns;
    if (level.parameter[knot] >= 0) sum[level.parameter[knot]] += total[k];
  }
}

double LayeredLattice::add_bending(std::span<const float> parameters,
                                   double weight,
                                   std::span<float> sum) const {
  check(parameters.size());
  check(sum.size());
  if (weight == 0) return 0;
  // Layers and levels share no parameter.
  std::vector<double> energy(levels_.size() * layers_, 0);
  tbb::parallel_for(size_t(0), energy.size(), [&](size_t task) {
    const Level& level = levels_[task / layers_];
    const size_t knots = size_t(level.x.knots) * level.y.knots;
    const Knots layer = {level.x.knots, level.y.knots, &level.parameter[task % layers_ * knots]};
    for (const SecondDifference& difference : second_differences(layer.columns)) {
      const double scale = weight * level.bending_weight * difference.weight;
      energy[task] += add_squares(difference, layer, parameters, scale, sum);
    }
  });
  return std::accumulate(energy.begin(), energy.end(), 0.0);
}

}  // namespace cgs
