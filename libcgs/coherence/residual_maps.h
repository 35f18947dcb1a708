// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "libcgs/coherence/conv_decoder.h"
#include "libcgs/coherence/layered_lattice.h"
#include "libcgs/coherence/parameter_block.h"

namespace cgs {

/// One number per pixel of every view, smooth within each depth layer and zero at first: lattices
/// of each view's own, or one convolutional network for all views.
class ResidualMaps {
 public:
  /// \param layers  of every pixel, as depth_layers() gives them, per view
  ResidualMaps(const std::vector<Raster<uint8_t>>& layers, const LayeredLatticeOptions& options);
  /// The value is gain (network - network before training), so that training starts at zero.
  /// \throws InvalidInput as ConvDecoder
  ResidualMaps(const std::vector<Raster<uint8_t>>& layers,
               const ConvDecoderOptions& options,
               float gain);

  /// One block per view of lattices, one of a network.
  std::vector<ParameterBlock> initial_blocks(ParameterRole role) const;

  /// \param value  per view; gets the size of the view
  void evaluate(std::span<const ParameterBlock> blocks, std::vector<Raster<float>>& value);

  /// Adds to the gradients of blocks, at the parameters of the last evaluate().
  /// \param by_value  dL/dvalue per view
  void add_gradient(std::vector<Raster<float>> by_value, std::span<ParameterBlock> blocks);

  /// LayeredLattice::add_bending() of all views; a network has no bending energy.
  double add_bending(double weight, std::span<ParameterBlock> blocks) const;

 private:
  std::vector<LayeredLattice> lattices_;  // of each view; none where there is a network
  std::optional<ConvDecoder> network_;
  std::vector<Raster<float>> untrained_;
  float gain_ = 1;
};

}  // namespace cgs
