// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads the vertices and faces of a Wavefront OBJ file; polygons become fans of triangles.
///
/// Colours behind the coordinates ("v x y z r g b") are taken if every vertex has them. Groups with
/// the names of write_obj() become provenance if every face is in one, else names of materials as
/// MaterialLabels says: other programs keep these, but no groups. Materials, textures, lines and
/// curves are ignored; no other file is opened.
/// \throws BadInput Syntax, Value (not finite), Ref (a face that names a vertex that is not there
///         yet), Empty (no vertex), each with the line number; LimitError for lines above 4 MiB
ParsedMesh read_obj(const std::filesystem::path& path);

}  // namespace cgs
