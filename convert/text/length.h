// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>

#include "libcgs/core/frame.h"

namespace cgs {

// Messages begin with `option`, the name of what was typed, such as "--voxel-size"; it may be
// empty.

/// Metres in a unit of length: "m", "cm", "mm", "um", "km", "in", "ft".
/// \throws InvalidInput that lists the units.
double metres_in(const std::string& unit, const std::string& option = {});

/// A length as users type it: "0.5mm" or "2cm" for scenes of known scale, a bare number in scene
/// units for any.
/// \return the length in internal units of the frame.
/// \throws InvalidInput for what is no positive length, or for a unit in a scene without scale.
double parse_length(const std::string& text, const Frame& frame, const std::string& option = {});

/// The same of a length that may be left out: 0 for an empty text.
double length_or_zero(const std::string& text, const Frame& frame, const std::string& option = {});

/// A coordinate, likewise, but of any sign, and zero.
/// \return in units of the file, not internal
double parse_coordinate(const std::string& text, const Frame& frame);

/// A length with its unit, "1.2m", in metres.
/// \throws InvalidInput
double parse_metres(const std::string& text, const std::string& option = {});

/// A length and its standard deviation in metres: "1.2m+-3mm" or "1.2m±3mm"; 0 where none is
/// stated.
/// \throws InvalidInput
std::pair<double, double> parse_metres_with_sigma(std::string text, const std::string& option = {});

/// A length [internal units] for people: "3.2 mm", or "0.0031 units" without scale.
std::string format_length(double internal_length, const Frame& frame);

/// Bytes as users type them: "4G", "512M", "1.5GiB", or a number of bytes.
/// \throws InvalidInput
size_t parse_bytes(const std::string& text, const std::string& option = {});

/// The size of a file as users type it: "2MB", "800kB" (powers of 1000), "1.5MiB" (powers of 1024),
/// or a number of bytes.
/// \throws InvalidInput
size_t parse_file_size(const std::string& text, const std::string& option = {});

/// The size of a file for people: "1.93 MB", "812 kB", in powers of 1000.
std::string format_file_size(size_t bytes);

/// A time as users type it: "90s", "3min", "1.5h", or a number of seconds [s].
/// \throws InvalidInput
double parse_seconds(const std::string& text, const std::string& option = {});

/// A time for people: "42 s", "2 min 5 s", "1 h 10 min".
std::string format_seconds(double seconds);

}  // namespace cgs
