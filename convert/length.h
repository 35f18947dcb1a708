// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/core/frame.h"

namespace cgs {

/// Metres in a unit of length: "m", "cm", "mm", "um", "km", "in", "ft".
/// \throws InvalidInput that lists the units.
double metres_in(const std::string& unit);

/// A length as users type it: "0.5mm" or "2cm" for scenes of known scale, a bare number in scene
/// units for any.
/// \return the length in internal units of the frame.
/// \throws InvalidInput for what is no positive length, or for a unit in a scene without scale.
double parse_length(const std::string& text, const Frame& frame);

/// A length with its unit, "1.2m", in metres. \throws InvalidInput
double parse_metres(const std::string& text);

/// A length [internal units] for people: "3.2 mm", or "0.0031 units" without scale.
std::string format_length(double internal_length, const Frame& frame);

/// Bytes as users type them: "4G", "512M", "1.5GiB", or a number of bytes. \throws InvalidInput
size_t parse_bytes(const std::string& text);

}  // namespace cgs
