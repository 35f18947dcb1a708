// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

inline constexpr size_t kMostSelfIntersections = 20'000'000;  ///< Pairs that are held.

/// Pairs of faces (smaller index first, ascending) that touch beyond the vertices and edges they
/// share by index. Decided with exact predicates, so there is no tolerance; works on any soup.
/// A face of zero area counts as intersecting itself.
/// \param progress  again after every hundred thousand pairs of boxes or so, of which nobody knows
///                  how many there are
/// \throws LimitError above kMostSelfIntersections, as of a hundred thousand equal faces
std::vector<std::pair<uint32_t, uint32_t>> self_intersections(const TriangleMesh& mesh,
                                                              const Progress& progress = {});

}  // namespace cgs
