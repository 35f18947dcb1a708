// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// How a mesh is smoothed.
struct SmoothingOptions {
  size_t iterations = 10;  ///< In 1 ... 10000.
  double inward = 0.5;     ///< Share of the way to the mean of the neighbours; in (0, 1].
  double outward = 0;      ///< Share of the way back in a second step of each iteration, against
                           ///< shrinking (Taubin: 0.53); in [0, 1].

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// A mesh whose vertices have moved.
struct SmoothedMesh {
  TriangleMesh mesh;
  size_t locked = 0;  ///< Vertices held in place.
  double rms = 0;     ///< Of the distances that the others moved [internal units].
  double most = 0;    ///< The longest of them.
};

/// Moves every vertex towards the mean of its neighbours, again and again. Neighbours weigh the
/// more the nearer they are (by 1 / distance), so that uneven meshes drift less along themselves.
///
/// Held in place are the vertices on open rims, on edges of more than two faces, and where faces
/// with evidence (Observed, SingleView) meet others, so that what was invented neither grows nor
/// drags what was measured. Labels, colours and support stay with their vertices; sigma becomes the
/// root of sigma^2 + distance moved^2: a smoother surface is not a better known one, and no longer
/// where it was measured. Normals, if any, are made anew from the faces.
/// Source: Taubin 1995, "A signal processing approach to fair surface design", with the weights of
/// Fujiwara 1995, "Eigenvalues of Laplacians on a closed Riemannian manifold and its nets".
SmoothedMesh smoothed(const TriangleMesh& mesh,
                      const SmoothingOptions& options,
                      const Progress& progress = {});

}  // namespace cgs
