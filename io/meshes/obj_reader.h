// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads the vertices and faces of a Wavefront OBJ file; polygons become triangles.
///
/// Colours behind the coordinates ("v x y z r g b") come first; else vertices take the colours of
/// materials and their pictures, see ObjPaint, from files in the folder of the OBJ. Groups with
/// the names of write_obj() become provenance if every face is in one, else names of materials as
/// MaterialLabels says: other programs keep these, but no groups. Normals, lines and curves are
/// ignored. What is not finite is dropped, see drop_unusable().
/// \throws BadInput Syntax, Ref (a face that names a vertex that is not there yet), each with the
///         line number, Empty (no vertex), Value as drop_unusable(); LimitError for lines above
///         4 MiB
ParsedMesh read_obj(const std::filesystem::path& path);

}  // namespace cgs
