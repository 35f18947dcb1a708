// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "io/splats/raw_splats.h"

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
///         Count, Truncated, Schema (degree, fractional bits, streams of v4), Syntax (a damaged
///         stream); LimitError
/// Source: nianticlabs/spz, its README, splat-types.h and loader; N. Zhang et al., "smallest three"
///         of v3.
RawSplats parse_spz(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
