// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "libcgs/core/raster.h"

namespace cgs {

/// A smooth function on each depth layer of all views, given by the weights of one small network:
/// the decoder of CoherentGS. LayeredLattice is the quick stand-in for it.
struct ConvDecoderOptions {
  int width = 15;  ///< Channels of a block are 16, 8 or 4 times this; in [1, 64].
  int layers = 5;  ///< Depth layers; in [1, 256].
  /// The two channels that tell the decoder where it is hold x and y in [-1, 1]; if this is set,
  /// the corner pattern that the published implementation fills them with.
  bool reference_coordinates = false;
  uint64_t seed = 0;  ///< Of the initial weights.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// What one block of the decoder puts out.
struct DecoderBlock {
  int channels = 0;
  int width = 0;
  int height = 0;
};

/// The blocks of a decoder of images, from 2 or 3 pixels along each axis to the image.
///
/// Each axis grows along the sequence of its halvings (odd pixels dropped) read backwards; the
/// shorter axis stays as it is in the last blocks. Channels are 16, 16, 16, 8, 8, 8, 4, 4, ...
/// times `width`.
/// \pre image_width >= 4, image_height >= 4
std::vector<DecoderBlock> decoder_blocks(int image_width, int image_height, int width);

/// value_n(p) = channel layer_n(p), at pixel p, of a network whose only input is the index n of
/// the view. Untrained, values are small: at most 1e-4 (width 6) to 4e-3 (width 18) on 504 x 378.
///
/// Input: sin 2^k t, cos 2^k t, k = 0..9, t = n / (views - 1), for each pixel. A block doubles its
/// input by bilinear interpolation (corners stay corners), reflects it by a pixel on each side, and
/// is a 3x3 convolution (the first: 1x1) and LeakyReLU 0.2. Two channels of coordinates join
/// after the first block. The last convolution gives one channel per layer; only that of each
/// pixel's layer is computed.
///
/// Parameters are ordered block by block, the last convolution last; each has its weights
/// [out][in][3][3] and then its biases [out].
///
/// Results are the same bits for any number of threads: every band of rows of every view is one
/// task on one oneTBB thread (so tbb::global_control limits them), in which oneDNN runs without
/// threads of its own, and sums over bands have a fixed order. They are not the same bits on
/// processors of different instruction sets, see Convolution.
/// Source: Paliwal et al. 2024, "CoherentGS", section 3 and published implementation.
class ConvDecoder {
 public:
  /// Allocates what evaluate() and add_gradient() need: about 40 bytes per pixel of all views and
  /// unit of options.width (350 MB for three views of 504 x 378 and a width of 15).
  ///
  /// \param layer_per_view  layer of every pixel, as depth_layers() gives it
  /// \throws InvalidInput if there is no view, a raster is not of the size of the images or holds
  ///         a layer beyond options.layers, or an image is smaller than 4 x 4
  ConvDecoder(int view_count,
              int image_width,
              int image_height,
              std::vector<Raster<uint8_t>> layer_per_view,
              const ConvDecoderOptions& options);
  ~ConvDecoder();
  ConvDecoder(ConvDecoder&& other) noexcept;
  ConvDecoder& operator=(ConvDecoder&& other) noexcept;

  size_t parameter_count() const;
  /// Weights from N(0, 0.02^2), biases 0: the same on every machine.
  std::vector<float> initial_parameters() const;

  /// The values of all views.
  /// \param parameters  parameter_count() values
  void evaluate(std::span<const float> parameters, std::vector<Raster<float>>& value_per_view);

  /// Adds dL/dparameters at the parameters of the last evaluate(), given dL/dvalue.
  /// \throws InvalidInput if there was none, or sizes differ
  void add_gradient(const std::vector<Raster<float>>& gradient_per_view, std::span<float> sum);

 private:
  struct Network;
  std::unique_ptr<Network> network_;
};

}  // namespace cgs
