// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

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
  /// \param layer  layer of every pixel, as depth_layers() gives it
  LayeredLattice(const Raster<uint8_t>& layer, const LayeredLatticeOptions& options);

  size_t parameter_count() const;
  /// Parameters of one level, [first, last).
  struct Range {
    size_t first, last;
  };
  Range level(size_t index) const;
  size_t level_count() const;

  /// The function at every pixel. \param parameters  parameter_count() values
  void evaluate(std::span<const float> parameters, Raster<float>& value) const;

  /// Adds the transpose of evaluate() applied to `gradient`: dL/dparameters from dL/df.
  void add_gradient(const Raster<float>& gradient, std::span<float> sum) const;

  /// Bending energy, the sum over levels and layers of squared second differences between knots
  /// that have parameters (along x, along y, and twice the mixed one), each level weighted so that
  /// it approximates the integral of squared second derivatives per pixel of the view.
  /// Adds weight times its derivative to `sum`. \return weight times the energy
  double add_bending(std::span<const float> parameters, double weight, std::span<float> sum) const;

 private:
  struct Level;
  int width_, height_;
  std::vector<uint8_t> layer_;
  std::vector<Level> levels_;
};

}  // namespace cgs
