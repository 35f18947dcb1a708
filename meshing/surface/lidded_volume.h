// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/components.h"

namespace cgs {

/// Volume of every part of a mesh, each of its holes closed by triangles to the middle of its rim
/// [internal units cubed]. Empty where neighbours disagree on what is outside, or more than two
/// faces meet at an edge.
std::vector<double> lidded_volumes(const TriangleMesh& mesh, const MeshComponents& parts);

/// The same for all parts together; NaN where they disagree, or without faces.
double lidded_volume(const TriangleMesh& mesh);

}  // namespace cgs
