// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The smallest convex solid around all vertices.
///
/// Its corners are vertices of the input with all they state. A face that was there before keeps
/// its label; the others span what nobody saw and are Inferred, also where the input states no
/// provenance.
/// \throws NumericalError if the vertices lie in one plane
TriangleMesh convex_hull(const TriangleMesh& mesh);

}  // namespace cgs
