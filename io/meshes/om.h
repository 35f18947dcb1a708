// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Writes a mesh with its evidence in OpenMesh's own format, version 1.2, in file coordinates.
///
/// Vertices as float [world units, minus frame.file_origin], normals, colours (a byte each, sRGB),
/// and the corners of faces, in the chunks that OpenMesh has for them. In properties that programs
/// see who add them before they read, and others pass over: of vertices "cgs:support" (float) and
/// "cgs:sigma" (float, [world units]; -1 = no statement), of faces "cgs:provenance" (uint8_t, the
/// numbers of Provenance), of the mesh "cgs:frame" (std::string, the lines of frame_comments()).
/// Version 1.2 lists the corners of faces; later ones list halfedges, which cannot say that more
/// than two faces meet at an edge. OpenMesh reads either, and gives such faces vertices of their
/// own. Its own writer would ask for its halfedges first, and writes version 2.2.
/// \throws InvalidInput if the mesh is not writable (an array does not fit, a vertex is not finite);
///         LimitError beyond 2^30 vertices or faces; IoError
/// Source: OpenMesh, OpenMesh/Core/IO/OMFormat.hh.
void write_om(const std::filesystem::path& path, const TriangleMesh& mesh, const Frame& frame);

}  // namespace cgs
