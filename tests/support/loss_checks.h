// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/train/losses.h"

namespace cgs::test {

inline Raster<float> noise_raster(int width, int height, unsigned seed, float low, float high) {
  Raster<float> out(width, height, 0);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(low, high);
  for (float& value : out.data) value = uniform(random);
  return out;
}

inline ColorPlanes noise_planes(int width, int height, unsigned seed) {
  ColorPlanes out;
  for (unsigned c = 0; c < 3; ++c) out[c] = noise_raster(width, height, 3 * seed + c, 0, 1);
  return out;
}

/// About two thirds of the pixels set.
inline MaskMap noise_mask(int width, int height, unsigned seed) {
  MaskMap out(width, height, 1);
  std::mt19937 random(seed);
  for (uint8_t& value : out.data) value = random() % 3 != 0;
  return out;
}

/// A raster in double, for references.
inline Raster<double> doubled(const Raster<float>& raster) {
  Raster<double> out(raster.width, raster.height, 0);
  std::copy(raster.data.begin(), raster.data.end(), out.data.begin());
  return out;
}

/// Compares `gradient` with central differences of value(x) at x, all in double; the error may
/// be `tolerance` of the largest derivative.
inline void expect_gradient(const Raster<float>& gradient,
                            const Raster<double>& x,
                            const std::function<double(const Raster<double>&)>& value,
                            double tolerance = 1e-4) {
  constexpr double kStep = 1e-6;
  ASSERT_EQ(gradient.data.size(), x.data.size());
  std::vector<double> expected;
  Raster<double> moved = x;
  for (size_t i = 0; i < x.data.size(); ++i) {
    moved.data[i] = x.data[i] + kStep;
    const double above = value(moved);
    moved.data[i] = x.data[i] - kStep;
    expected.push_back((above - value(moved)) / (2 * kStep));
    moved.data[i] = x.data[i];
  }
  double largest = 0;
  for (const double derivative : expected) largest = std::max(largest, std::abs(derivative));
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(gradient.data[i], expected[i], tolerance * largest + 1e-9) << "at pixel " << i;
  }
}

/// Calls body() with 1, 2, 3 and 4 threads.
inline void for_thread_counts(const std::function<void()>& body) {
  for (size_t threads = 1; threads <= 4; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    body();
  }
}

}  // namespace cgs::test
