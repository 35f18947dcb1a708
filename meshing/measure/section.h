// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/drawing.h"
#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/measured_value.h"

namespace cgs {

/// A plane with axes to draw in.
struct CutPlane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [internal units]; (0, 0) of the drawing.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();  ///< Unit, along x of the drawing.
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();     ///< Unit, along y of the drawing.
};

/// A plane across a normal. Planes across a coordinate axis are drawn along the other two, so that
/// numbers in the drawing are coordinates; else `up` is as near to +z as the plane allows.
/// \throws InvalidInput if the normal has no direction
CutPlane cut_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

/// Where a plane meets a mesh.
struct Section {
  std::vector<DrawnLine> lines;  ///< [internal units] in the axes of the plane.
  MeasuredValue length;          ///< Of all lines; sigma is that of their bends and open ends.
  MeasuredValue area;  ///< Within the lines, where an inner line is a hole; NaN where lines are
                       ///< open, as nobody knows what these enclose. Parts not stated.
  size_t open_lines = 0;
};

/// The lines are stitched by edges of the mesh, not by distance. A vertex in the plane counts as
/// above it, so that every face gives one piece or none. Of an oriented mesh, outer lines run
/// counter-clockwise around `normal`.
Section section(const MeasurableMesh& mesh, const CutPlane& plane);

}  // namespace cgs
