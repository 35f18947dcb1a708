// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/residual_maps.h"

#include "libcgs/core/error.h"

namespace cgs {

ResidualMaps::ResidualMaps(const std::vector<Raster<uint8_t>>& layers,
                           const LayeredLatticeOptions& options) {
  for (const Raster<uint8_t>& layer : layers) lattices_.emplace_back(layer, options);
}

ResidualMaps::ResidualMaps(const std::vector<Raster<uint8_t>>& layers,
                           const ConvDecoderOptions& options,
                           float gain)
    : gain_(gain) {
  require(!layers.empty(), "a decoder must have views", layers.size());
  network_.emplace(
      static_cast<int>(layers.size()), layers[0].width, layers[0].height, layers, options);
  network_->evaluate(network_->initial_parameters(), untrained_);
}

std::vector<ParameterBlock> ResidualMaps::initial_blocks(ParameterRole role) const {
  std::vector<ParameterBlock> out(network_ ? 1 : lattices_.size(), {role, {}, {}});
  for (size_t n = 0; n < lattices_.size(); ++n) out[n].resize(lattices_[n].parameter_count());
  if (network_) {
    out[0].resize(network_->parameter_count());
    out[0].value = network_->initial_parameters();
  }
  return out;
}

void ResidualMaps::evaluate(std::span<const ParameterBlock> blocks,
                            std::vector<Raster<float>>& value) {
  if (network_) {
    network_->evaluate(blocks[0].value, value);
    for (size_t n = 0; n < value.size(); ++n) {
      for (size_t i = 0; i < value[n].data.size(); ++i) {
        value[n].data[i] = gain_ * (value[n].data[i] - untrained_[n].data[i]);
      }
    }
    return;
  }
  value.resize(lattices_.size());
  for (size_t n = 0; n < lattices_.size(); ++n) lattices_[n].evaluate(blocks[n].value, value[n]);
}

void ResidualMaps::add_gradient(std::vector<Raster<float>> by_value,
                                std::span<ParameterBlock> blocks) {
  if (network_) {
    for (Raster<float>& map : by_value) {
      for (float& gradient : map.data) gradient *= gain_;
    }
    network_->add_gradient(by_value, blocks[0].gradient);
    return;
  }
  for (size_t n = 0; n < lattices_.size(); ++n) {
    lattices_[n].add_gradient(by_value[n], blocks[n].gradient);
  }
}

double ResidualMaps::add_bending(double weight, std::span<ParameterBlock> blocks) const {
  double sum = 0;
  for (size_t n = 0; n < lattices_.size(); ++n) {
    sum += lattices_[n].add_bending(blocks[n].value, weight, blocks[n].gradient);
  }
  return sum;
}

}  // namespace cgs
