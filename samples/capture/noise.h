// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

namespace cgs {

/// Mixes a counter; the same bits on every machine.
/// Source: M. O'Neill, PCG (output function RXS-M-XS), 2014.
inline uint32_t mixed(uint32_t x) {
  x = x * 747796405U + 2891336453U;
  x = ((x >> ((x >> 28U) + 4U)) ^ x) * 277803737U;
  return (x >> 22U) ^ x;
}
inline uint32_t mixed(uint32_t a, uint32_t b) { return mixed(a ^ mixed(b)); }

/// Uniform in [0, 1).
inline float uniform(uint32_t a, uint32_t b) {
  return static_cast<float>(mixed(a, b) >> 8U) * 0x1p-24F;
}

/// 0 below a, 1 above b, smooth between.
inline float smooth_step(float a, float b, float x) {
  const float t = std::fmin(std::fmax((x - a) / (b - a), 0.0F), 1.0F);
  return t * t * (3 - 2 * t);
}

/// Gradient noise on the unit lattice, zero mean, roughly in [-1, 1], about one wave per unit.
/// Source: K. Perlin, "Improving Noise", 2002 (own hash instead of the permutation table).
float gradient_noise(const Eigen::Vector3f& p, uint32_t seed);

/// A band of octaves of gradient noise: wavelengths longest, longest / 2, … down to shortest.
struct NoiseBand {
  float longest = 1;      ///< [m]
  float shortest = 0.1F;  ///< [m]
  float gain = 1;         ///< Amplitude of an octave relative to the next longer one.
};

/// Sum of the octaves of a band at p [m]. Octaves that a footprint [m] cannot resolve fade out, so
/// that supersampling is enough against aliasing.
float band_noise(const Eigen::Vector3f& p, const NoiseBand& band, float footprint, uint32_t seed);

}  // namespace cgs
