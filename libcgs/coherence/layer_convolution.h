// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libcgs/coherence/feature_map.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// 3x3 convolution with bias and one output channel per layer, of which each pixel has only that
/// of its own layer. The edge is reflected without being repeated.
///
/// Each call works on one band of `in` on the thread that makes it, with all sums in a fixed
/// order. `layer` holds, for each pixel of `in`, a number below the number of layers.
class LayerConvolution {
 public:
  /// \param lanes  of the feature maps
  LayerConvolution(int channels, int layers, int lanes);

  /// Of weights and biases together.
  size_t parameter_count() const;
  /// \param parameters  weights [layer][channel][3][3], then biases [layer]
  void set_parameters(std::span<const float> parameters);

  /// \param out  has the size of `in`; the rows of the band are written
  void forward(const FeatureMap& in,
               const Raster<uint8_t>& layer,
               int band,
               Raster<float>& out) const;

  /// dL/din from dL/dout.
  /// \param in   only its sizes matter
  /// \param out  a band of `in`, overwritten
  void backward_input(const Raster<float>& gradient,
                      const Raster<uint8_t>& layer,
                      const FeatureMap& in,
                      int band,
                      float* out) const;

  /// Floats that backward_parameters() writes, in an order of its own.
  size_t gradient_size() const;
  /// dL/dparameters from dL/dout in one band.
  void backward_parameters(const Raster<float>& gradient,
                           const Raster<uint8_t>& layer,
                           const FeatureMap& in,
                           int band,
                           float* out) const;
  /// Adds `count` results of backward_parameters(), which lie one behind the other, in their order
  /// to a sum in the order of set_parameters().
  void add_gradients(const float* gradients, size_t count, std::span<float> sum) const;

 private:
  size_t channels_, layers_;
  size_t padded_;        // channels, filled up to whole groups
  FloatBuffer weights_;  // [layer][tap][channel]
  std::vector<float> biases_;
};

}  // namespace cgs
