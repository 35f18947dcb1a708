// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/vertex_faces.h"

namespace cgs {

VertexFaces faces_of_vertices(size_t vertices, std::span<const std::array<uint32_t, 3>> faces) {
  VertexFaces out;
  out.first.assign(vertices + 1, 0);
  for (const auto& face : faces) {
    for (const uint32_t v : face) ++out.first[v + 1];
  }
  for (size_t v = 1; v < out.first.size(); ++v) out.first[v] += out.first[v - 1];
  out.faces.resize(3 * faces.size());
  std::vector<uint32_t> next(out.first.begin(), out.first.end() - 1);
  for (uint32_t f = 0; f < faces.size(); ++f) {
    for (const uint32_t v : faces[f]) out.faces[next[v]++] = f;
  }
  return out;
}

}  // namespace cgs
