// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>

namespace cgs {

/// A step between pixels.
struct Direction {
  int dx, dy;
};

/// Where to look for measured depth around a pixel that has none; the four neighbours come first.
inline constexpr std::array<Direction, 16> kDirections = {{{1, 0},
                                                           {-1, 0},
                                                           {0, 1},
                                                           {0, -1},
                                                           {1, 1},
                                                           {-1, 1},
                                                           {1, -1},
                                                           {-1, -1},
                                                           {2, 1},
                                                           {-2, 1},
                                                           {2, -1},
                                                           {-2, -1},
                                                           {1, 2},
                                                           {-1, 2},
                                                           {1, -2},
                                                           {-1, -2}}};

inline constexpr std::span<const Direction, 4> kNeighbors = std::span(kDirections).first<4>();

}  // namespace cgs
