// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The face on the other side of each of the three edges of every face (edge k joins corners k and
/// k + 1); the face itself at a border. Where more than two faces share an edge, some pair.
std::vector<std::array<uint32_t, 3>> adjacent_faces(const TriangleMesh& mesh);

}  // namespace cgs
