// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Moves a mesh or point cloud and finds the frame in which floats hold it best again.
///
/// Normals turn with the surface, mirrored faces are turned round, and sigma grows by the largest
/// factor by which a length may grow, so that it is never understated. Unit and scale source stay.
/// \param frame       in: that of the mesh; out: the new one
/// \param motion      from and to coordinates relative to `zero`
/// \param zero        world point of (0, 0, 0) of these coordinates
/// \throws InvalidInput if the motion is not finite or flattens the mesh
void move_mesh(TriangleMesh& mesh,
               Frame& frame,
               const Eigen::Affine3d& motion,
               const Eigen::Vector3d& zero);

/// Moves a mesh from its frame into another one; units are matched where both state them.
void move_to_frame(TriangleMesh& mesh, const Frame& from, const Frame& to);

}  // namespace cgs
