// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/bytes/byte_reader.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Reads a grey PFM file ("Pf"): 32-bit floats of either byte order, as they are; the scale in the
/// header, which programs use for other things than a factor, only tells the byte order.
///
/// \throws BadInput Open, Empty, Magic, Unsupported (colour), Syntax, Value, Truncated; LimitError
/// Source: Debevec, "PFM Portable FloatMap Image Format"; rows run from the bottom up.
Raster<float> read_pfm(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace cgs
