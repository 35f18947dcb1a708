// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What edge collapse must keep. Every vertex of the input is a witness: at any time it lies within
/// its tolerance of a face of its own label.
struct CollapseLimits {
  /// Per vertex [internal units], >= 0; 0 = the vertex stays. Where all are longer than the
  /// diagonal of the mesh and colours may change, distances are not looked at, which is faster.
  std::vector<float> tolerance;
  float color = 1;          ///< Largest change of a colour channel at a witness on a face that
                            ///< is not Inferred.
  size_t target_faces = 0;  ///< Stop when so few are left.
  size_t batch = 0;         ///< Collapses tried at once; any number gives the same mesh, 0 is fast.
};

/// What a run did, for a run with smaller tolerances to repeat.
struct CollapseHistory {
  struct Collapse {
    uint32_t from = 0, into = 0;  ///< The vertex that went, and the one that moved.
    std::array<double, 3> point = {};
    float t = 0;            ///< Where that is along the edge from `into`, in [0, 1].
    size_t first_heir = 0;  ///< Of its entries in `heirs`, which end where the next one's begin.
  };
  std::vector<Collapse> collapses;
  /// Per witness that changed hands the face that took it, counted among those that moved; none
  /// where more than 255 did.
  std::vector<uint8_t> heirs;
  std::vector<size_t> passes;    ///< Number of collapses after each pass.
  std::vector<float> tolerance;  ///< As in its limits.
};

struct CollapsedMesh {
  TriangleMesh mesh;                 ///< Attributes as in the input; unused vertices are gone.
  std::vector<uint32_t> witness_of;  ///< Per input vertex the output face it is near; ~0 = none.
  CollapseHistory history;
};

/// Collapses edges, cheapest quadric error first, as long as the limits allow.
///
/// The topology of the surface and of every label is kept: collapses obey the link condition, a
/// vertex between labels or on the rim moves only along that border, and one where borders meet
/// stays, as does one where the surface is not manifold. No face turns by more than 60 degrees in
/// one collapse. New vertices take colour and sigma interpolated along the edge and the smaller
/// support of its ends.
///
/// Own code, because the libraries at hand take 11 s (CGAL) to 20 s (OpenMesh) for 10^6 faces and
/// keep neither labels nor a bound: edges are sorted by cost and collapsed in passes, so that costs
/// are computed in parallel and nothing has to be kept in a heap. The result does not depend on the
/// number of threads.
/// Sources: Garland, Heckbert 1997 (cost); Ciampalini et al. 1997, "Multiresolution decimation
/// based on global error" (witnesses); Dey et al. 1999 (link condition).
/// Where a run comes after another whose tolerances were no smaller, its collapses are repeated,
/// and only those are judged anew that a changed tolerance or another outcome nearby concerns: the
/// two meshes differ only there.
/// \param before  history of a run on the same mesh with the same limits but larger or equal
///                tolerances; null = none
/// \pre face indices are below mesh.vertices.size(); limits.tolerance is as long as mesh.vertices.
/// Progress is the share of the faces that are gone.
CollapsedMesh collapse_edges(const TriangleMesh& mesh,
                             const CollapseLimits& limits,
                             const CollapseHistory* before = nullptr,
                             const Progress& progress = {});

}  // namespace cgs
