// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace cgs {

/// What a block of parameters moves; an optimiser treats blocks of one role alike.
enum class ParameterRole { Depth, Opacity, Shape };

/// Numbers that an optimiser changes, and the derivative of the loss with respect to each.
struct ParameterBlock {
  ParameterRole role = ParameterRole::Depth;
  std::vector<float> value;
  std::vector<float> gradient;

  /// `values` as they are now, no gradient yet.
  void start(std::vector<float> values) {
    gradient.assign(values.size(), 0);
    value = std::move(values);
  }
};

}  // namespace cgs
