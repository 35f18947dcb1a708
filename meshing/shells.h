// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh whose shells bound one solid.
struct SettledShells {
  TriangleMesh mesh;
  size_t turned = 0;   ///< Shells that look the other way now.
  size_t dropped = 0;  ///< Shells with matter on both sides, as of a doubled surface.
};

/// Makes the shells of a mesh bound one solid.
///
/// Outermost shells come to look outwards; where one has to be turned, all within it turn with it.
/// A shell within another stays where matter ends or begins there, as around a cavity, and goes
/// where there is matter, or none, on both sides.
/// \pre closed, manifold, neighbours agree on the winding, faces do not cut each other
SettledShells settled_shells(const TriangleMesh& mesh);

}  // namespace cgs
