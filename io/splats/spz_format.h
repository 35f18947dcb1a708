// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string_view>

// What the reader and the writer of SPZ files share.

namespace cgs {

constexpr std::string_view kSpzMagic = "NGSP";
constexpr double kSpzColorScale = 0.15;
constexpr int kMostSpzFractionalBits = 23;

/// The parts of a file in their order: all of one attribute, then all of the next.
enum SpzPart : size_t { Positions, Opacities, Colors, Scales, Rotations, Harmonics, PartCount };

}  // namespace cgs
