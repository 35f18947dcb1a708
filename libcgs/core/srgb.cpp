// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/srgb.h"

#include <cmath>

namespace cgs {

float linear_from_srgb(float value) {
  const double v = std::abs(static_cast<double>(value));
  const double linear = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  return static_cast<float>(std::copysign(linear, static_cast<double>(value)));
}

float srgb_from_linear(float value) {
  const double v = std::abs(static_cast<double>(value));
  const double coded = v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  return static_cast<float>(std::copysign(coded, static_cast<double>(value)));
}

}  // namespace cgs
