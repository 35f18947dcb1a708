// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/membrane.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

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

// One sweep over all pixels, those of one colour of a chessboard after those of the other.
void sweep(Raster<float>& values, const Raster<MembranePixel>& pixels, float pull, float step) {
  for (int color = 0; color < 2; ++color) {
    for (int y = 0; y < values.height; ++y) {
      for (int x = 0; x < values.width; ++x) {
        if ((x + y) % 2 != color || pixels(x, y) != MembranePixel::Open) continue;
        float sum = 0;
        float count = 0;
        const auto add = [&](int u, int v) {
          if (!pixels.contains(u, v) || pixels(u, v) == MembranePixel::Outside) return;
          sum += values(u, v);
          ++count;
        };
        add(x - 1, y);
        add(x + 1, y);
        add(x, y - 1);
        add(x, y + 1);
        const float rest = count > 0 ? sum / (count + pull) : values(x, y);
        values(x, y) += step * (rest - values(x, y));
      }
    }
  }
}

TEST(Membrane, SweepsOverOpenPixelsAsOverAllForAnyNumberOfThreads) {
  constexpr float kReach = 5;
  Raster<float> start(37, 29, 0);
  Raster<MembranePixel> pixels(37, 29, MembranePixel::Fixed);
  for (size_t i = 0; i < start.data.size(); ++i) {
    start.data[i] = std::sin(0.7f * static_cast<float>(i));
    if (i / 37 == 11) continue;  // a row without any
    if (i % 5 == 0 || i % 7 < 3) pixels.data[i] = MembranePixel::Open;
    if (i % 11 == 0) pixels.data[i] = MembranePixel::Outside;
  }
  Raster<float> expected = start;
  for (int k = 0; k < 20; ++k) {
    sweep(expected, pixels, 1 / (kReach * kReach), k + 8 < 20 ? 1.8f : 1.0f);
  }
  for (const size_t threads : {size_t{1}, size_t{4}}) {
    const tbb::global_control some(tbb::global_control::max_allowed_parallelism, threads);
    Raster<float> values = start;
    relax_membrane(values, pixels, kReach, 20);
    EXPECT_EQ(values.data, expected.data) << threads;
  }
}

}  // namespace
}  // namespace cgs::membrane_test
