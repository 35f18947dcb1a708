// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A side of a face, from corner `side` to the next one: the lower vertex and the higher one.
struct FaceSide {
  uint32_t low, high, face, side;
  bool same_edge(const FaceSide& other) const { return low == other.low && high == other.high; }
};

/// The sides of all faces, those of one edge next to each other: by low, high, face and side.
std::vector<FaceSide> sides_by_edge(const TriangleMesh& mesh);

}  // namespace cgs
