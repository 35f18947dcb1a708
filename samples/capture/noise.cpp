// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/noise.h"

namespace cgs {

namespace {

float gradient_dot(uint32_t h, const Eigen::Vector3f& d) {
  const float u = (h & 8U) != 0 ? d.y() : d.x();
  const float v = (h & 12U) == 0 ? d.y() : ((h & 13U) == 12 ? d.x() : d.z());
  return ((h & 1U) != 0 ? -u : u) + ((h & 2U) != 0 ? -v : v);
}

float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

float mix(float a, float b, float t) { return a + t * (b - a); }

}  // namespace

float gradient_noise(const Eigen::Vector3f& p, uint32_t seed) {
  const Eigen::Vector3f cell = p.array().floor();
  const Eigen::Vector3f d = p - cell;
  const auto x = static_cast<uint32_t>(static_cast<int32_t>(cell.x()));
  const auto y = static_cast<uint32_t>(static_cast<int32_t>(cell.y()));
  const auto z = static_cast<uint32_t>(static_cast<int32_t>(cell.z()));
  const auto corner = [&](uint32_t i, uint32_t j, uint32_t k) {
    const uint32_t h =
        mixed((x + i) * 73856093U ^ (y + j) * 19349663U ^ (z + k) * 83492791U ^ seed);
    const Eigen::Vector3f offset(
        static_cast<float>(i), static_cast<float>(j), static_cast<float>(k));
    return gradient_dot(h >> 13U, d - offset);
  };
  const float u = fade(d.x());
  const float v = fade(d.y());
  const float w = fade(d.z());
  const float front =
      mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v);
  const float back =
      mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v);
  return mix(front, back, w);
}

float band_noise(const Eigen::Vector3f& p, const NoiseBand& band, float footprint, uint32_t seed) {
  // Each octave is turned, so that the lattices do not line up.
  static const Eigen::Matrix3f kTurn =
      (Eigen::Matrix3f() << 0.00F, 0.80F, 0.60F, -0.80F, 0.36F, -0.48F, -0.60F, -0.48F, 0.64F)
          .finished();
  Eigen::Vector3f q = p;
  float amplitude = 1;
  float sum = 0;
  for (float wavelength = band.longest; wavelength >= 0.999F * band.shortest; wavelength /= 2) {
    const float resolved = smooth_step(1.0F, 2.0F, wavelength / footprint);
    if (resolved <= 0) break;
    q = kTurn * q;
    sum += amplitude * resolved * gradient_noise(q / wavelength, seed++);
    amplitude *= band.gain;
  }
  return sum;
}

}  // namespace cgs
