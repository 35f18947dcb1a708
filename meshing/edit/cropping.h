// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What of a mesh or point cloud lies where (p - point) . normal >= 0.
///
/// Faces across the plane are cut, neighbours at the same points, so that no cracks open; the cut
/// is left open. Parts keep the label of their face, new vertices lie between the ends of the edge
/// they cut; see append_blend().
/// \param point, normal  [internal units]; normal of any length > 0
TriangleMesh cropped_by_plane(const TriangleMesh& mesh,
                              const Eigen::Vector3d& point,
                              const Eigen::Vector3d& normal);

/// What lies in a box along the axes; faces are cut as by six planes.
TriangleMesh cropped_by_box(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box);

/// The vertices within a ball, and the faces all of whose corners are.
TriangleMesh cropped_by_ball(const TriangleMesh& mesh,
                             const Eigen::Vector3d& center,
                             double radius);

}  // namespace cgs
