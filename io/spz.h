// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include <Eigen/Core>

#include "io/raw_splats.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// True for an SPZ file: gzip around, or at once, the letters NGSP.
bool looks_like_spz(std::string_view bytes);

/// Nothing compresses better than this.
constexpr uint64_t kSpzSplatsPerByte = 1 << 12;

/// What the header of an SPZ file says.
struct SpzCount {
  uint64_t splats = 0;
  uint64_t harmonics = 0;  ///< Coefficients of a splat, as they are kept.
};

/// \param start  the beginning of the file
/// \throws BadInput as parse_spz()
SpzCount stated_spz_splats(std::string_view start, const std::filesystem::path& path);

/// Reads SPZ versions 2 and 3 (one gzip stream, or the same not compressed) and 4 (Zstandard
/// streams). The axes of SPZ (right, up, back) are turned into those of the 3DGS PLY (right, down,
/// forward): y and z change sign, and so do rotations and spherical harmonics. Files that state
/// other axes (SPZ_ADOBE_coordinate_system) are turned from those; other extensions are left out.
///
/// \throws BadInput Magic, Unsupported (another version or coordinate system), Empty (no splats),
/// Count, Truncated,
///         Schema (degree, fractional bits, streams of v4), Syntax (a damaged stream); LimitError
/// Source: nianticlabs/spz, its README, splat-types.h and loader; N. Zhang et al., "smallest three"
/// of v3.
RawSplats parse_spz(std::string_view bytes, const std::filesystem::path& path);

struct SpzOptions {
  int version = 3;  ///< 2 (rotations in 3 bytes, what glTF extensions embed) or 3 (in 4 bytes).
  /// Up to this far, places need not be told apart [internal units]; 0 = as write_spz() says. What
  /// no picture can show takes a third of the bits of a place, and compresses like noise.
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
