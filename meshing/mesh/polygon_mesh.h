// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include "libcgs/core/triangle_mesh.h"

// For the source files that hand meshes to CGAL; no other header includes this one.
namespace cgs::polygon_mesh {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using PolygonMesh = CGAL::Surface_mesh<Point>;

inline Point point_of(const Eigen::Vector3f& p) {
  return {double(p.x()), double(p.y()), double(p.z())};
}

inline Eigen::Vector3f vector_of(const Point& p) {
  return Eigen::Vector3d(p.x(), p.y(), p.z()).cast<float>();
}

/// The mesh with halfedges; vertices and faces keep their numbers.
/// \throws NumericalError that starts with `user` where more than two faces meet at an edge, faces
///         disagree on what is outside, sheets meet in a single vertex that the faces of one go all
///         around, or a face names a vertex twice
PolygonMesh from_triangles(const TriangleMesh& mesh, const char* user);

/// The vertices and faces that were not removed, in their order.
TriangleMesh to_triangles(const PolygonMesh& mesh);

}  // namespace cgs::polygon_mesh
