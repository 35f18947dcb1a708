// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "io/bytes/significance.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// Splats as their file holds them, before anything is judged or repaired: any value may be NaN or
/// infinite, rotations have any length. Axes are those of the 3DGS PLY: formats that are defined in
/// others are turned when they are read.
struct RawSplats {
  std::string format;                      ///< For people: "3DGS PLY", "SPZ 3", …
  int sh_degree = 0;                       ///< 0 … 3
  std::vector<Eigen::Vector3d> position;   ///< [file units]
  std::vector<Eigen::Vector3f> log_scale;  ///< Natural log of the standard deviation [file units].
  std::vector<Eigen::Vector4f> rotation;   ///< (w, x, y, z)
  std::vector<float> logit;                ///< Of the opacity.
  std::vector<Eigen::Vector3f> sh;         ///< Gaussian-major, (sh_degree + 1)^2 for each.
  std::vector<float> provenance;           ///< Numbers of Provenance; empty = not stated.
  std::vector<float> synthetic;            ///< As Gaussians; any numbers. Empty = none is made up.
  std::vector<SyntheticSource> synthetic_sources;  ///< As the file lists them.
  int digits = kFloatDigits;                       ///< Binary digits of a position as stored.
  bool may_be_linear = false;         ///< Programs differ: scales may really be lengths, and
                                      ///< opacities probabilities.
  bool is_antialiased = false;        ///< For viewers that compensate opacity for blur.
  std::vector<std::string> comments;  ///< Of a PLY header.
  std::string evidence;               ///< As GaussianFile.
  std::vector<std::string> notes;     ///< One line each: what was left out, or looks odd.

  size_t size() const { return position.size(); }
  /// RGB coefficients of a splat.
  size_t sh_count() const {
    const auto side = static_cast<size_t>(sh_degree) + 1;
    return side * side;
  }
  void reserve(size_t count) {
    position.reserve(count);
    log_scale.reserve(count);
    rotation.reserve(count);
    logit.reserve(count);
    sh.reserve(count * sh_count());
  }
};

/// Opacity stored in a byte. The ends stand for what rounds to them: 255 is not opacity 1, whose
/// logit is infinite, but the middle of its upper half step.
inline float logit_of_byte(uint8_t byte) {
  const double opacity = std::clamp(byte / 255.0, 0.25 / 255, 1 - 0.25 / 255);
  return static_cast<float>(std::log(opacity / (1 - opacity)));
}

/// A value in [0, 1] as the nearest byte.
inline uint8_t unit_byte(double value) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace cgs
