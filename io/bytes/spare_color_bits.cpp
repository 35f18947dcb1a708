// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/spare_color_bits.h"

#include <cmath>

#include "libcgs/core/srgb.h"

namespace cgs {

int spare_color_bits(float linear, int bits) {
  constexpr float kHalfLevel = 0.5f / 255;
  const float code = srgb_from_linear(linear);
  int spare = 0;
  while (spare < bits) {
    // Half of what the last place counts if one bit more is dropped; darker is the worse side.
    const float move = std::ldexp(1.0f, spare) / std::ldexp(1.0f, bits);
    if (linear < move || code - srgb_from_linear(linear - move) > kHalfLevel) break;
    ++spare;
  }
  return spare;
}

}  // namespace cgs
