// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Writes a mesh as 3MF in millimetres, or in micrometres or metres where it is so small or so far
/// from the origin that six decimals of a millimetre, below 1e9, do not hold it.
///
/// Vertices are file coordinates, rotated and scaled. Where every edge has two faces of opposite
/// directions, the object is a "model" that looks outward, else a "surface". Faces that name a
/// vertex twice are left out: the format forbids them. Where the mesh has provenance, every
/// triangle carries the base material of its class ("observed", "single view", "interpolated",
/// "estimated", "inferred", "virtual"), and the Description metadata tells the area of each, and
/// how many millimetres to add to the coordinates where file_origin is not 0. The same mesh gives
/// the same bytes.
/// \param up_rotation  world axes to file axes; z_up_from(up), as the format demands
/// \throws InvalidInput if the scale of the frame is unknown, nothing is left of the mesh, no unit
///         holds it, or it is not writable (an array does not fit, a vertex is not finite); IoError
/// Source: 3MF Core Specification 1.x, 3MF Consortium.
void write_3mf(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const Frame& frame,
               const Eigen::Matrix3d& up_rotation);

}  // namespace cgs
