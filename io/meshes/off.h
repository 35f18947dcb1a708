// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads an ASCII OFF file (OFF, COFF, NOFF, CNOFF, STOFF and their combinations; the keyword may
/// stand right before the numbers, or be missing); polygons become triangles. Normals and colours
/// of vertices, else colours of faces, are taken, texture coordinates are not. What is not finite
/// is dropped, see drop_unusable().
///
/// \throws BadInput Magic, Unsupported (binary, four dimensions), Syntax, Count, Truncated, Ref,
///         Value, Empty, with the line number; LimitError
/// Source: Geomview manual, "OFF: polyhedron".
ParsedMesh read_off(const std::filesystem::path& path);

}  // namespace cgs
