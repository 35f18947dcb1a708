// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Pairs of faces (smaller index first, ascending) that touch beyond the vertices and edges they
/// share by index. Decided with exact predicates, so there is no tolerance; works on any soup.
/// A face of zero area counts as intersecting itself.
/// \throws LimitError above 20 million pairs, as of a hundred thousand equal faces
std::vector<std::pair<uint32_t, uint32_t>> self_intersections(const TriangleMesh& mesh);

}  // namespace cgs
