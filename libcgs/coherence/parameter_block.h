// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace cgs {

/// What a block of parameters moves; an optimiser treats blocks of one role alike.
enum class ParameterRole { Depth, Opacity, Color, Shape };

/// Numbers that an optimiser changes, and the derivative of the loss with respect to each.
struct ParameterBlock {
  ParameterRole role = ParameterRole::Depth;
  std::vector<float> value;
  std::vector<float> gradient;

  void resize(size_t count) {
    value.assign(count, 0);
    gradient.assign(count, 0);
  }
};

}  // namespace cgs
