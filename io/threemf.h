// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Writes a mesh as 3MF with the unit attribute "millimeter".
///
/// Vertices are file coordinates, rotated and scaled, to six decimals. Where the mesh has
/// provenance, every triangle carries the base material of its class ("observed", "single view",
/// "interpolated", "inferred"), and the Description metadata tells the area of each, and what to
/// add to the coordinates where file_origin is not 0. The same mesh gives the same bytes. \param
/// up_rotation  world axes to file axes; z_up_from(up), as the format demands \throws InvalidInput
/// if the scale of the frame is unknown, the mesh has no face, a face names a
///         vertex twice (the format forbids it), or the mesh is not writable (an array does not
///         fit, a vertex is not finite); IoError
/// Source: 3MF Core Specification 1.x, 3MF Consortium.
void write_3mf(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const Frame& frame,
               const Eigen::Matrix3d& up_rotation);

}  // namespace cgs
