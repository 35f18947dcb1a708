// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/raster.h"

namespace cgs {

/// A smooth function on each depth layer of a view, given by few numbers: what lets neighbouring
/// pixels of one surface move together and those across a depth edge move apart.
struct LayeredLatticeOptions {
  std::vector<int> spacing = {128, 64, 32, 16};  ///< Of the knots of each level [pixels]; >= 2,
                                                 ///< strictly falling.
  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// f(p) = sum over levels l and knots k of B((x - x_k) / h_l) B((y - y_k) / h_l) a[l][layer(p)][k],
/// with the uniform cubic B-spline B and pixel centres at +0.5.
///
/// Only knots whose support meets a pixel of their layer have a parameter. Parameters are ordered
/// level by level (coarse to fine), layer by layer, row-major.
/// Results are the same bits for any number of threads.
/// Source: Forsey and Bartels 1988, "Hierarchical B-spline refinement"; CoherentGS's decoders,
///         which this stands in for, also output one map per layer.
class LayeredLattice {
 public:
  /// \param layer  layer of every pixel, as depth_layers() gives it; not empty
  LayeredLattice(const Raster<uint8_t>& layer, const LayeredLatticeOptions& options);

  size_t parameter_count() const { return levels_.back().range.last; }
  /// Parameters of one level, [first, last).
  struct Range {
    size_t first, last;
  };
  Range level(size_t index) const { return levels_[index].range; }
  size_t level_count() const { return levels_.size(); }

  /// Writes the function at every pixel into `value`, which gets the size of the view.
  /// \param parameters  parameter_count() values
  void evaluate(std::span<const float> parameters, Raster<float>& value) const;

  /// Adds the transpose of evaluate() applied to `gradient`: dL/dparameters from dL/df.
  void add_gradient(const Raster<float>& gradient, std::span<float> sum) const;

  /// Bending energy, the sum over levels and layers of squared second differences between knots
  /// that have parameters (along x, along y, and twice the mixed one). A level of spacing h counts
  /// 1 / (h^2 width height), so that it approximates the integral of squared second derivatives
  /// [1 / pixel^2] per pixel of the view.
  /// Adds weight times its derivative to `sum`.
  /// \return weight times the energy
  double add_bending(std::span<const float> parameters, double weight, std::span<float> sum) const;

 private:
  // The knots along one axis, knot k at (k - 1) spacing, and for each pixel the first of the four
  // that it depends on.
  struct Axis {
    Axis(int pixels, int spacing);
    int knots;
    std::vector<int> first;
    std::vector<Eigen::Array4f> weight;
  };
  struct Level {
    Axis x, y;
    double bending_weight = 0;
    Range range = {};
    std::vector<int32_t> parameter = {};  // of (layer, knot row, knot column); -1 = none
  };
  // One row of pixels at one level: a spline in x for each layer.
  struct Row {
    float* folded;  // of (layer, knot column)
    const int* first;
    const Eigen::Array4f* weight;
    int columns;
    Eigen::Map<Eigen::Array4f> at(int x, int layer) const {
      return Eigen::Map<Eigen::Array4f>(folded + ptrdiff_t(layer) * columns + first[x]);
    }
  };

  void number_knots(Level& level, size_t first) const;
  void check(size_t parameters) const;
  std::vector<Row> rows_in(std::vector<float>& folded) const;
  void fold(const Level& level, const float* knots, int y, float* folded) const;
  void gather(const Level& level,
              size_t begin_of_level,
              int knot_row,
              const std::vector<std::vector<float>>& folded,
              std::span<float> sum) const;

  Raster<uint8_t> layer_;
  int layers_ = 0;
  std::vector<Level> levels_;
};

}  // namespace cgs
