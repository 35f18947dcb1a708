// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/face_adjacency.h"

#include <algorithm>
#include <utility>

namespace cgs {

namespace {

using Edge = std::array<uint32_t, 2>;

struct FaceSide {
  Edge edge;
  uint32_t face;
  // NOLINTNEXTLINE(modernize-use-nullptr): false alarm on a defaulted comparison
  auto operator<=>(const FaceSide&) const = default;
};

}  // namespace

std::vector<std::array<uint32_t, 3>> adjacent_faces(const TriangleMesh& mesh) {
  std::vector<std::pair<FaceSide, uint32_t>> sides;
  sides.reserve(3 * mesh.faces.size());
  std::vector<std::array<uint32_t, 3>> out(mesh.faces.size());
  for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
    out[f].fill(f);
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t a = mesh.faces[f][k];
      const uint32_t b = mesh.faces[f][(k + 1) % 3];
      sides.push_back({{{std::min(a, b), std::max(a, b)}, f}, k});
    }
  }
  std::sort(sides.begin(), sides.end());
  for (size_t i = 0; i + 1 < sides.size(); ++i) {
    const auto& [a, ka] = sides[i];
    const auto& [b, kb] = sides[i + 1];
    if (a.edge != b.edge) continue;
    out[a.face][ka] = b.face;
    out[b.face][kb] = a.face;
  }
  return out;
}

}  // namespace cgs
