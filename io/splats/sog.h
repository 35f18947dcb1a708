// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "io/splats/raw_splats.h"

namespace cgs {

/// True for a ZIP archive, which is what a .sog file is.
bool looks_like_sog(std::string_view bytes);

/// Reads a bundled SOG file, version 2: a ZIP archive with meta.json and lossless WebP images whose
/// pixels are the quantised attributes of one splat each.
///
/// \throws BadInput as ZipArchive and parse_json(); Schema (a key is missing or has another type),
///         Unsupported (another version), Empty (no splats), Count (an image is too small), Value
///         (codebooks not finite), Syntax (an image cannot be decoded); LimitError
/// Source: PlayCanvas, "The SOG format", version 2.
RawSplats parse_sog(std::string_view bytes, const std::filesystem::path& path);

}  // namespace cgs
