// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The mesh with every triangle split into four, so many times, and its vertices moved so that the
/// surface becomes smooth.
///
/// Open rims, edges of more than two faces, and edges between faces with evidence (Observed,
/// SingleView) and others stay sharp: they become smooth curves of their own, so that what was
/// invented does not drag what was seen; where other than two of these meet, the vertex stays.
/// Parts keep the label of their face. Vertices take the mean of what the two ends of their edge
/// state, see append_blend(); sigma becomes the root of sigma^2 + distance moved^2. Normals, if
/// any, are made anew from the faces.
/// Source: Loop 1987, "Smooth subdivision surfaces based on triangles"; Hoppe et al. 1994,
/// "Piecewise smooth surface reconstruction" (sharp edges).
/// \throws LimitError beyond 2^28 faces
TriangleMesh loop_subdivided(const TriangleMesh& mesh, size_t times);

}  // namespace cgs
