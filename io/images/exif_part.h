// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace cgs {

/// The Exif part of an image file as libexif takes it: "Exif", two zeros and a small TIFF file.
/// From a TIFF file, whose directories are those of its Exif part, come the
/// maker, the model and what tells the focal length. Empty for other files, for those without such
/// a part, and where it is damaged.
/// Own code, because libexif finds that part in JPEG only.
/// \param bytes  the whole file; of a JPEG its first segments are enough
/// Source: CIPA DC-008 (Exif 2.32) 4.5 and 4.6; PNG (W3C, 3rd ed.) 11.3.2.6, eXIf; raw profiles of
///         PNG as ExifTool's tables tell them; WebP container specification, EXIF.
std::string exif_part(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
