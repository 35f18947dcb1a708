// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Appends to `out` every face of a mesh as four, each with the label of the whole.
/// \param middle  of two corners: the vertex of `out` between them
template <typename Middle>
void split_faces(const TriangleMesh& mesh, const Middle& middle, TriangleMesh& out) {
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    const uint32_t ab = middle(a, b);
    const uint32_t bc = middle(b, c);
    const uint32_t ca = middle(c, a);
    out.faces.insert(out.faces.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    if (!mesh.provenance.empty()) {
      out.provenance.insert(out.provenance.end(), 4, mesh.provenance[f]);
    }
  }
}

}  // namespace cgs
