// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "libcgs/coherence/feature_map.h"

namespace cgs {

/// Channels that lie side by side in a FeatureMap on this processor: 16 with AVX-512, else 8.
int convolution_lanes();

/// 3x3 convolution with bias of horizontal bands, without padding: an input of (width + 2) x
/// (rows + 2) pixels gives width x rows. All blocks of channels are [group][row][x][lane] with
/// convolution_lanes() lanes, as a band of a FeatureMap, unused lanes zero.
///
/// Each call runs on the thread that makes it and on no other, so several bands can be worked on
/// at once and a result does not depend on how many are. It does depend on the processor: the
/// widest vector instructions are used, and with AVX-512, for bands of at least 400 pixels, the
/// Winograd transform, which rounds differently (relative error about 1e-6).
/// Source: oneDNN; Lavin and Gray 2016, "Fast algorithms for convolutional neural networks".
class Convolution {
 public:
  /// \param width  of the output [pixels]
  /// \param rows   heights of band that will occur, none twice
  Convolution(int in_channels, int out_channels, int width, const std::vector<int>& rows);
  ~Convolution();
  Convolution(Convolution&& other) noexcept;
  Convolution& operator=(Convolution&& other) noexcept;

  /// Of weights and biases together.
  size_t parameter_count() const;
  /// \param parameters  weights [out][in][3][3], then biases [out]
  void set_parameters(std::span<const float> parameters);

  /// \param scratch  any buffer that no other thread uses; grows as needed
  void forward(int rows, const float* input, float* output, FloatBuffer& scratch) const;
  /// The transpose of forward() without bias: dL/dinput from dL/doutput.
  void backward_input(int rows,
                      const float* output_gradient,
                      float* input_gradient,
                      FloatBuffer& scratch) const;

  /// Floats that backward_parameters() writes, in an order of its own.
  size_t gradient_size() const;
  /// The input of a band, and the derivative of the loss with respect to its output.
  struct Band {
    const float* input;
    const float* output_gradient;
  };
  /// dL/dparameters from one band.
  void backward_parameters(int rows, const Band& band, float* gradient, FloatBuffer& scratch) const;
  /// Adds the sum of `count` results of backward_parameters(), which lie one behind the other, in
  /// the order of set_parameters(); they are added up in their order and overwritten.
  void add_gradients(float* gradients, size_t count, std::span<float> sum) const;

 private:
  struct Primitives;
  std::unique_ptr<Primitives> primitives_;
};

}  // namespace cgs
