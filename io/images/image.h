// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "io/bytes/byte_reader.h"
#include "libcgs/core/raster.h"

namespace cgs {

struct ImageSize {
  int width = 0;   ///< [pixels]
  int height = 0;  ///< [pixels]
};

/// The size of a PNG, JPEG, TIFF, WebP, HEIC or AVIF file from its header; the format is told from
/// the content, not the name. Orientation tags of Exif are ignored here: see orientation.h.
/// \throws BadInput as parse_image_header(); LimitError above max_pixels.
ImageSize image_size(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Decodes an image to sRGB-coded RGB in [0, 1]. Grey, palette and 16-bit images are converted;
/// of several pages the first is read; float TIFF is clamped. Colours of another profile than sRGB,
/// as of phones, become sRGB: see color_profile.h.
///
/// \param alpha_mask  where not null: emptied if every pixel is usable, else 1 where alpha is at
///                    least 0.5 and, for float images, the colour is finite
/// \throws BadInput Truncated (also when a decoder only warns about missing data, which those of
///         HEIC and AVIF rarely do), Syntax, Unsupported, Magic, Open, Empty; LimitError before
///         anything is decoded.
ColorImage read_image(const std::filesystem::path& path,
                      MaskMap* alpha_mask = nullptr,
                      const ReadLimits& limits = {});

/// The same for the content of an image file, as it is coded, as glTF wants its textures.
/// \param path  of the file that holds it, for messages
ColorImage decode_image(std::string_view bytes,
                        const std::filesystem::path& path,
                        MaskMap* alpha_mask = nullptr,
                        const ReadLimits& limits = {});

/// The first channel of an image as stored, neither scaled nor clamped: what depth maps are kept
/// in.
struct StoredSamples {
  Raster<float> values;
  int whole_bits = 0;  ///< 8 or 16 if samples are whole numbers, else 0.
};

/// Decodes a PNG or TIFF (one page) of grey levels.
/// \throws Error as read_image(); BadInput Unsupported for JPEG and WebP, which do not keep values,
///         and for more than one channel beside alpha
StoredSamples read_samples(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace cgs
