// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "io/splats/raw_splats.h"

namespace cgs {

/// True if the bytes start as a .ksplat file does: version 0.1 in a header of 4096 bytes. The
/// format has no magic number.
bool looks_like_ksplat(std::string_view bytes);

/// Reads a .ksplat file, version 0.1: a header of 4096 bytes, one of 1024 for each section, then
/// for each section the sizes of its buckets that are not full, the centres of all its buckets, and
/// its splats. With compression level 0 all numbers are floats; with 1 positions are 16-bit steps
/// around the centre of a bucket and the others 16-bit floats; with 2 harmonics are bytes. Colours
/// and opacities are bytes throughout.
///
/// \throws BadInput Unsupported (another version or level), Empty, Count (sizes that do not fit
///         each other or the file), Schema (degree above 3), Truncated, Value (the grid of
///         positions or range of harmonics is not finite)
/// Source: mkkellogg/GaussianSplats3D, the files its viewer writes and reads.
RawSplats parse_ksplat(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
