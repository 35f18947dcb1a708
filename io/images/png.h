// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "libcgs/core/raster.h"

namespace cgs {

/// An 8-bit RGB PNG file in memory; values are clamped to [0, 1], NaN becomes 0.
/// \throws InvalidInput for an empty raster or one wider or higher than PNG allows.
std::string encode_png(const ColorImage& image);

/// The same with an alpha channel: transparent where `shown` is 0.
/// \throws Error as above; InvalidInput if the sizes differ
std::string encode_png(const ColorImage& image, const MaskMap& shown);

/// An 8-bit grey PNG file in memory: 0 stays 0, everything else becomes 255.
std::string encode_png(const MaskMap& mask);

/// A JPEG file in memory, for textures and pictures inside HTML: 4:4:4, so that colour edges stay
/// where they are, and progressive, which is a twelfth smaller for the same pixels.
/// \param quality  1 … 100
/// \throws InvalidInput
std::string encode_jpeg(const ColorImage& image, int quality);

/// encode_png() into a file.
/// \throws InvalidInput, IoError
void write_png(const std::filesystem::path& path, const ColorImage& image);
void write_png(const std::filesystem::path& path, const MaskMap& mask);

}  // namespace cgs
