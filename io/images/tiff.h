// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/core/raster.h"

namespace cgs {

/// A raster as the bytes of a TIFF file of one 32-bit float per pixel, without loss (Deflate). NaN
/// stays NaN, which programs for maps take as "no data".
/// \throws InvalidInput for an empty raster
std::string encode_tiff(const Raster<float>& values);

}  // namespace cgs
