// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// Views that one is compared with, at most. Time then grows with the number of views, not with its
/// square.
inline constexpr size_t kMostCompared = 8;

/// The other input views that together tell the most of what one of them may show: they see its
/// places, over its range of depth, from directions worth comparing (worth_of_angle()). Where there
/// are no more than `most` others, that is all of them.
///
/// \param input  position in scene.input
/// \return positions in scene.input, ascending
std::vector<size_t> neighbours(const Scene& scene, size_t input, size_t most);

/// The pairs of input views of which one is among the kMostCompared neighbours of the other.
/// \return positions in scene.input, the smaller first, ascending
std::vector<std::pair<size_t, size_t>> neighbouring_pairs(const Scene& scene);

}  // namespace cgs
