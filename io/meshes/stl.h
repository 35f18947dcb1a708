// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Writes a mesh as binary STL in millimetres.
///
/// Vertices are file coordinates, rotated and scaled; facet normals follow the corners. STL has no
/// place for a unit or for evidence: the header line names the unit and, where file_origin is not
/// 0, what to add to the coordinates.
/// \param up_rotation  world axes to file axes; z_up_from(up), as readers of STL expect
/// \throws InvalidInput if the scale of the frame is unknown, the mesh has no face or is not
///         writable (an array does not fit, a vertex is not finite); IoError
void write_stl(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const Frame& frame,
               const Eigen::Matrix3d& up_rotation);

/// Whether the header of a file says that write_stl() made it; false if it cannot be read.
bool is_own_stl(const std::filesystem::path& path);

}  // namespace cgs
