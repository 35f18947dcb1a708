// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "libcgs/core/raster.h"

namespace cgs {

/// The ICC profile that a JPEG, PNG, TIFF, WebP, HEIC or AVIF file holds; of HEIC and AVIF that
/// state the primaries of Display P3 by number, a profile of these. Empty if there is none, or none
/// that can be found: whether the picture is whole, its decoder tells.
/// Source: ICC.1:2022 annex B.4 (JPEG, APP2); PNG 3rd edition 11.3.2.3 (iCCP); TIFF tag 34675; WebP
///         container (ICCP); ISO/IEC 14496-12 (colr); ITU-T H.273 (primaries 12).
std::string color_profile(std::string_view bytes, const std::filesystem::path& path);

/// Turns colours of a profile into sRGB-coded ones, relative to white; those that sRGB cannot hold
/// lose saturation. Profiles that say sRGB change no bit, and what is no profile of RGB is ignored.
/// \param image  coded as the profile says, in [0, 1]
void to_srgb(std::string_view profile, ColorImage& image);

/// Turns L* of 0 to 100, a* and b* (CIE 1976, white D50) into sRGB-coded colours, relative to
/// white.
void lab_to_srgb(ColorImage& image);

/// Amounts of cyan, magenta, yellow and black, from 0 to 1 = full.
using InkImage = Raster<std::array<float, 4>>;

/// The sRGB-coded colours of inks: by the profile where it is one of CMYK, relative to white, else
/// (1 - ink)(1 - black).
ColorImage srgb_of_inks(std::string_view profile, const InkImage& inks);

}  // namespace cgs
