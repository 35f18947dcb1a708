// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/spare_color_bits.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/srgb.h"

namespace cgs::spare_color_bits_test {
namespace {

TEST(SpareColorBits, GrowWithBrightness) {
  int before = 0;
  for (int code = 0; code <= 255; ++code) {
    const int spare = spare_color_bits(linear_from_srgb(float(code) / 255), 11);
    EXPECT_GE(spare, before) << code;
    before = spare;
  }
  EXPECT_EQ(spare_color_bits(0, 11), 0);
  EXPECT_EQ(before, 4);
}

// A value without its spare bits, against the code that it stood for: half a level off at most, or
// what a place of all bits is.
TEST(SpareColorBits, MoveNoCodeByMoreThanHalfALevel) {
  for (const int bits : {8, 11, 16}) {
    const double most = std::ldexp(1.0, bits) - 1;
    for (int tenth = 0; tenth <= 2550; ++tenth) {
      const float code = float(tenth) / 2550;
      const float linear = linear_from_srgb(code);
      const double place = std::ldexp(1.0, spare_color_bits(linear, bits));
      const double kept = std::min(1.0, std::round(linear * most / place) * place / most);
      const double finest = 12.92 * 255 * 0.5 / most;  // where the code is steepest
      const double off = 255 * std::abs(srgb_from_linear(float(kept)) - code);
      EXPECT_LE(off, std::max(0.51, finest)) << tenth << " with " << bits << " bits";
    }
  }
}

}  // namespace
}  // namespace cgs::spare_color_bits_test
