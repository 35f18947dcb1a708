// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/halfedges.h"

namespace cgs {

/// Appends to `out` every face of a mesh as four, each with the label of the whole.
/// \param links   halfedges_of(mesh)
/// \param middle  of an edge: the vertex of `out` between its ends
template <typename Middle>
void split_faces(const TriangleMesh& mesh,
                 const halfedges::HalfedgeMesh& links,
                 const Middle& middle,
                 TriangleMesh& out) {
  out.faces.reserve(out.faces.size() + 4 * mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    auto side = links.halfedge_handle(halfedges::FaceHandle(static_cast<int>(f)));
    const uint32_t ab = middle(links.edge_handle(side));
    side = links.next_halfedge_handle(side);
    const uint32_t bc = middle(links.edge_handle(side));
    const uint32_t ca = middle(links.edge_handle(links.next_halfedge_handle(side)));
    out.faces.insert(out.faces.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    if (!mesh.provenance.empty()) {
      out.provenance.insert(out.provenance.end(), 4, mesh.provenance[f]);
    }
  }
}

}  // namespace cgs
