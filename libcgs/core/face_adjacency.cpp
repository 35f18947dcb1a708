// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/face_adjacency.h"

#include <algorithm>
#include <tuple>

namespace cgs {

std::vector<FaceSide> sides_by_edge(const TriangleMesh& mesh) {
  std::vector<FaceSide> sides;
  sides.reserve(3 * mesh.faces.size());
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(mesh.faces[f].at(k), mesh.faces[f].at((k + 1) % 3));
      sides.push_back({low, high, f, k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const FaceSide& a, const FaceSide& b) {
    return std::tie(a.low, a.high, a.face, a.side) < std::tie(b.low, b.high, b.face, b.side);
  });
  return sides;
}

}  // namespace cgs
