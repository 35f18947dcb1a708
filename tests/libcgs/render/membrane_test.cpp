// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/membrane.h"

#include <cmath>

#include <gtest/gtest.h>

namespace cgs::membrane_test {
namespace {

TEST(Membrane, GoesOnWithAPlaneThatHoldsItsRim) {
  Raster<float> values(40, 30, 0);
  Raster<MembranePixel> pixels(40, 30, MembranePixel::Open);
  const auto plane = [](int x, int y) {
    return 1 + 0.02f * static_cast<float>(x) - 0.01f * static_cast<float>(y);
  };
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      if (x > 0 && y > 0 && x < 39 && y < 29) continue;
      pixels(x, y) = MembranePixel::Fixed;
      values(x, y) = plane(x, y);
    }
  }
  relax_membrane(values, pixels, 0, 600);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) EXPECT_NEAR(values(x, y), plane(x, y), 1e-4) << x << ", " << y;
  }
}

// Of a strip that is held at one end: values fall by the same factor from pixel to pixel, the root
// below 1 of r + 1 / r = 2 + 1 / reach^2.
TEST(Membrane, FallsToZeroOverItsReach) {
  constexpr float kReach = 8;
  Raster<float> values(160, 3, 0);
  Raster<MembranePixel> pixels(160, 3, MembranePixel::Open);
  for (int y = 0; y < 3; ++y) {
    pixels(0, y) = MembranePixel::Fixed;
    values(0, y) = 1;
  }
  relax_membrane(values, pixels, kReach, 300);
  const double half = 1 + 0.5 / (kReach * kReach);
  const double factor = half - std::sqrt(half * half - 1);
  EXPECT_NEAR(factor, std::exp(-1 / kReach), 1e-3);
  for (int x = 0; x < 60; ++x) EXPECT_NEAR(values(x, 1), std::pow(factor, x), 1e-4) << x;
}

TEST(Membrane, EndsWhereItHasNoPart) {
  Raster<float> values(9, 1, 0);
  Raster<MembranePixel> pixels(9, 1, MembranePixel::Open);
  pixels(0, 0) = MembranePixel::Fixed;
  values(0, 0) = 2;
  pixels(8, 0) = MembranePixel::Outside;
  values(8, 0) = -100;
  relax_membrane(values, pixels, 0, 300);
  for (int x = 0; x < 8; ++x) EXPECT_NEAR(values(x, 0), 2, 1e-4);
  EXPECT_EQ(values(8, 0), -100);
}

}  // namespace
}  // namespace cgs::membrane_test
