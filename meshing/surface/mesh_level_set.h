// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include <openvdb/openvdb.h>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Distances to a closed mesh in a band of three voxels, - inside, where inside is all that cannot
/// be reached from outside: faces may cut each other and look anywhere. Cavities are filled.
/// \param voxel  edge [internal units]; > 0
/// \pre every edge of the mesh has two faces or more, else the outside comes in
/// \throws LimitError if the surface crosses too many voxels
openvdb::FloatGrid::Ptr enclosing_level_set(const TriangleMesh& mesh, double voxel);

/// What enclosing_level_set() surrounds [internal units cubed].
double enclosed_by_level_set(const openvdb::FloatGrid& surface);

}  // namespace cgs
