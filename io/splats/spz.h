// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

struct SpzOptions {
  int version = 3;  ///< 2 (rotations in 3 bytes, what glTF extensions embed) or 3 (in 4 bytes).
  /// Distance below which positions need not be told apart [internal units]; 0 = as write_spz()
  /// says. Digits that no picture can show take a third of the bits of a position, and compress
  /// like noise.
  double finest = 0;
  /// World axes to right, up and back; the usual ones are those that parse_spz() turns back. With
  /// y_up_from(up) a scene stands upright in viewers, and is read turned.
  Eigen::Matrix3d y_up = Eigen::Vector3d(1, -1, -1).asDiagonal();

  /// \throws InvalidInput naming the first field out of range, or if y_up is no rotation.
  void validate() const;
};

struct SpzReport {
  size_t bytes = 0;
  int fractional_bits = 0;  ///< Positions are multiples of 2^-fractional_bits [file units].
  uint64_t clamped = 0;     ///< Splats with a colour, scale or harmonic beyond what a byte can say.
};

/// Writes an SPZ file in file coordinates, axes turned as parse_spz() turns them back.
///
/// Positions have 24 bits. 12 of them are fractional, as everywhere, unless the scene reaches
/// beyond +-2048 units (then fewer) or is so small that a step would be more than 2^-16 of it (then
/// more); or as many as SpzOptions::finest asks for.
/// \throws InvalidInput as write_gaussian_ply(), or if positions reach so far that a step would be
///         more than a thousandth of the scene's size; IoError
SpzReport write_spz(const std::filesystem::path& path,
                    const Gaussians& gaussians,
                    const Frame& frame,
                    const SpzOptions& options = {});

}  // namespace cgs
