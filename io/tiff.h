// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "libcgs/core/raster.h"

namespace cgs {

/// Writes a raster as a TIFF file of one 32-bit float per pixel, without loss (Deflate). NaN stays
/// NaN, which programs for maps take as "no data".
/// \throws InvalidInput for an empty raster; IoError
void write_tiff(const std::filesystem::path& path, const Raster<float>& values);

}  // namespace cgs
