// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A point cloud with one point per occupied cube of a grid: the mean of its points.
///
/// Where points of a cube have a sigma, only these are averaged: what nobody vouches for does not
/// move what was measured. Sigma is the root of the mean of squares, as errors of neighbours need
/// not cancel; support is the smallest. Points come in the order of the first of their cube.
/// \param side  of a cube [internal units], > 0
/// \throws InvalidInput if the mesh has faces, or for a grid beyond 2^21 cubes along an axis
TriangleMesh down_sampled(const TriangleMesh& cloud, double side);

}  // namespace cgs
